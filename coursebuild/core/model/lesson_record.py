"""What the outputs and figures of a lesson were recorded with: the file `LESSON.recorded.txt`.

It lies beside the lesson, is kept in Git with it, and is never published. Each recording has a
heading and below it a line, whose first word says of what kind it is:

    [examples/heat.py output 1]
    recorded 5d41402abc4b2a76: exact; Python 3.12.4; linux x86_64; imports scipy 1.17.1; with …

A line is found by the hash of what is recorded. So one that Git has merged with another, or that
was left by an edit by hand, says nothing of any other text; and a recording without a line is one
of which nobody knows what it was made with. The headings and the empty lines between them never
change, so that Git merges the lines of two branches. Lines of kinds that are not known here stay.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from msgspec import Struct, field

from coursebuild.core.model.blocks import Comparison, Mode, Recording
from coursebuild.core.text.source import Excerpt

Versions: TypeAlias = tuple[tuple[str, str], ...]
"""Names of packages, each with its version."""

ENDING = ".recorded.txt"
FIGURE = "figure"
"""How a figure is compared."""
_HEAD = """\
# What the outputs and figures of {name} were recorded with.
# `coursebuild update` writes a line where it records one. Keep this file in Git, beside the lesson.
"""
_HEADING = re.compile(r"\[(.+)\]")
_LINE = re.compile(r"[a-z]+ .*")
_RECORDED = re.compile(r"recorded ([0-9a-f]+): (.*)")
_PROPER_NAMES = {
    "matplotlib": "Matplotlib",
    "mujoco": "MuJoCo",
    "numpy": "NumPy",
    "scipy": "SciPy",
}
"""Names as their makers write them; other packages have the names of their distributions."""
_MOST_NAMED = 3
"""The most packages that a message names of those that others brought along."""


class Address(Struct, frozen=True, omit_defaults=True):
    """Where in an output a value was printed; numbers in words are written `#`."""

    line: str
    place: int
    """The index of the first of its numbers in the line."""
    heading: str = ""
    name: str = ""
    names: tuple[str, ...] = ()
    """The numbers that tell the line from others with its words, and those of all such lines."""


class Provenance(Struct, frozen=True):
    """What a script ran with."""

    python: str
    """Such as `Python 3.12.4`."""
    platform: str
    """The system, the kind of processor and the C library, such as `linux x86_64 glibc 2.36`."""
    packages: Versions = ()
    """What the script imports, or a module of the course that it imports, sorted."""
    requirements: Versions = ()
    """What those import, sorted."""


def shown_versions(provenances: Iterable[Provenance | None]) -> tuple[str, ...]:
    """What pages say that scripts ran with; nothing where none ran."""
    packages: dict[str, None] = {}
    pythons: dict[str, None] = {}
    for made_with in provenances:
        if made_with is not None:
            packages |= dict.fromkeys(
                f"{proper_name(name)} {version}" for name, version in made_with.packages
            )
            pythons[made_with.python] = None
    return (*sorted(packages), *sorted(pythons))


class Recorded(Struct, frozen=True):
    """How something was recorded."""

    digest: str
    comparison: str
    """How it was to be compared, as its fence says it; for a figure, `figure`."""
    provenance: Provenance

    @property
    def line(self) -> str:
        """It as a line of the file."""
        made_with = self.provenance
        parts = [self.comparison, made_with.python, made_with.platform]
        for word, versions in (
            ("imports", made_with.packages),
            ("with", made_with.requirements),
        ):
            if versions:
                parts.append(f"{word} " + ", ".join(map(" ".join, versions)))
        return f"recorded {self.digest}: {'; '.join(parts)}"

    @classmethod
    def of_line(cls, line: str) -> Recorded | None:
        """What a line says; `None` where it is no such line."""
        match = _RECORDED.fullmatch(line)
        parts = match[2].split("; ") if match is not None else []
        if match is None or len(parts) < 3:
            return None
        comparison, python, platform, *lists = parts
        words = (text.partition(" ") for text in lists)
        versions = {word: _versions(text) for word, _, text in words}
        made_with = Provenance(
            python, platform, versions.get("imports", ()), versions.get("with", ())
        )
        return cls(match[1], comparison, made_with)

    def change(self, now: Provenance, comparison: str = FIGURE) -> str:
        """What is different now, as the beginning of a message; empty where nothing is."""
        before = self.provenance
        pairs = [(f"{name} {old}", new) for name, old, new in _changed(before, now, "packages")]
        if before.python != now.python:
            pairs.append((before.python, now.python.removeprefix("Python ")))
        if not pairs:
            changes = list(_changed(before, now, "requirements"))[:_MOST_NAMED]
            pairs = [(f"{name} {old}", new) for name, old, new in changes]
        if before.platform != now.platform:
            pairs.append((before.platform, now.platform))
        if self.comparison != comparison:
            pairs.append((f"comparison `{self.comparison}`", f"`{comparison}`"))
        if not pairs:
            return ""
        old, new = (_join(words) for words in zip(*pairs, strict=True))
        return f"recorded with {old}, this is {new}"


class LessonRecord(Struct, frozen=True):
    """A file: its lines by their headings, in order."""

    sections: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> LessonRecord:
        """The record in a text; what is neither a heading nor a line of any kind is left out."""
        sections: dict[str, tuple[str, ...]] = {}
        heading = ""
        for line in map(str.strip, text.splitlines()):
            if match := _HEADING.fullmatch(line):
                heading = match[1]
                sections.setdefault(heading, ())
            elif heading and _LINE.fullmatch(line) and line not in sections[heading]:
                sections[heading] += (line,)
        return cls(sections)

    def text(self, name: str) -> str:
        """The file beside the lesson of this name; empty where it would say nothing."""
        parts = [
            f"[{heading}]\n" + "".join(f"{line}\n" for line in lines)
            for heading, lines in self.sections.items()
        ]
        return "\n".join((_HEAD.format(name=name), *parts)) if parts else ""

    def find(self, script: str, digest: str) -> Recorded | None:
        """How something of a script was recorded that has this hash now."""
        for heading, lines in self.sections.items():
            if heading.startswith(f"{script} "):
                recordings = (Recorded.of_line(line) for line in lines)
                if match := next(
                    (r for r in recordings if r is not None and r.digest == digest), None
                ):
                    return match
        return None

    def with_recordings(self, recordings: Iterable[tuple[str, Recorded | None]]) -> LessonRecord:
        """The record of a lesson whose recordings, in order, have these headings.

        With `None`, nothing is known of one but what is here already.
        """
        sections: dict[str, tuple[str, ...]] = {}
        for heading, recorded in recordings:
            lines = self.sections.get(heading, ())
            further_lines = tuple(line for line in lines if Recorded.of_line(line) is None)
            new_lines = (() if recorded is None else (recorded.line,)) + further_lines
            if new_lines:
                sections[heading] = new_lines
        return LessonRecord(sections)


def record_path(document: str) -> str:
    """The path of the record of a lesson or page, given its own."""
    return document.removesuffix(".md") + ENDING


def output_heading(script: str, number: int) -> str:
    """The heading of an output of a script; they are numbered from 1."""
    return f"{script} output {number}"


def figure_heading(script: str, name: str) -> str:
    """The heading of a figure of a script, or of its data."""
    return f"{script} {name}"


def recording_digest(recording: Recording) -> str:
    """The hash of a recorded output; white space at the ends of lines does not count."""
    body = recording.body
    text = body.text if isinstance(body, Excerpt) else recording.body_span.text
    lines = "\n".join(map(str.rstrip, text.splitlines()))
    return data_digest(lines.strip("\n").encode())


def data_digest(data: bytes) -> str:
    """The hash of a recorded file; Git may change its line ends."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()[:16]


def describe_comparison(comparison: Comparison) -> str:
    """How an output is compared, as its fence would say it."""
    words = [comparison.mode.value]
    if comparison.mode is Mode.TOLERANCE:
        tolerances = {"rtol": comparison.rtol, "atol": comparison.atol}
        words = [f"{key}={value}" for key, value in tolerances.items() if value]
    words += ["ellipsis"] if comparison.ellipsis else []
    words += ["volatile=…"] if comparison.volatile else []
    return " ".join(words)


def proper_name(package: str) -> str:
    """A package as a text names it."""
    return _PROPER_NAMES.get(package, package)


def _versions(text: str) -> Versions:
    pairs = (part.rpartition(" ") for part in text.split(", ") if part)
    return tuple((name, version) for name, _, version in pairs)


def _changed(before: Provenance, now: Provenance, field: str) -> Iterator[tuple[str, str, str]]:
    """The packages of which another version is used now: name, recorded version, this one."""
    present = dict((*now.packages, *now.requirements))
    for name, version in getattr(before, field):
        if present.get(name, version) != version:
            yield proper_name(name), version, present[name]


def _join(words: Iterable[str]) -> str:
    *rest, last = words
    return f"{', '.join(rest)} and {last}" if rest else last
