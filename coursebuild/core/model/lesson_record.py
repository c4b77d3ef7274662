"""What a lesson shows, with what it was recorded and where it was printed: `LESSON.recorded.txt`.

The file lies beside the lesson, is kept in Git with it, and is never published. It has a line of
JSON for each recording and each shown value, and an empty line after each, so that Git merges
neighbouring lines of two branches:

    {"is":"recording","of":"examples/heat.py output 1","digest":"5d41402abc4b2a76",…}
    {"is":"value","value":{"text":"2.52",…},"at":[{"line":"it cools in # s","place":0}]}

A recording is found by the hash of what is recorded, a value by its text and the words around. So a
line that Git has merged with others, or that was left by an edit by hand, says nothing of any other
text. Nothing is known of what has no line; a line that cannot be read counts for nothing.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

import msgspec
from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.model.blocks import Comparison, Mode, Recording
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

Versions: TypeAlias = tuple[tuple[str, str], ...]
"""Names of packages, each with its version."""

ENDING = ".recorded.txt"
FIGURE = "figure"
"""How a figure is compared."""
_HEAD = """\
# With what the lesson beside this was recorded, and where its numbers were printed. `coursebuild`
# keeps a line for each when it updates the lesson, or finds it right. Keep this file in Git.
"""
_PROPER_NAMES = {
    "matplotlib": "Matplotlib",
    "mujoco": "MuJoCo",
    "numpy": "NumPy",
    "scipy": "SciPy",
}
"""Names as their makers write them; other packages have the names of their distributions."""
_MOST_NAMED = 3
"""The most packages that a message names of those that others brought along."""
_PER_UNIT = regex(r"(?<=# )# (?=/[^\W\d_])")
"""The 1 of a unit among the words of a line, as in `# # /s`: it is none of its numbers."""


class Address(Struct, frozen=True, omit_defaults=True):
    """Where in an output a value was printed; numbers in words are written `#`."""

    line: str
    place: int
    """The index of the first of its numbers in the line."""
    heading: str = ""
    name: str = ""
    names: tuple[str, ...] = ()
    """The numbers that tell the line from others with its words, and those of all such lines."""

    @property
    def description(self) -> str:
        """The line in words."""
        numbers = iter(self.name.split())
        outer, slash, heading = self.heading.rpartition(" / ")
        heading = outer + slash + re.sub("#", lambda match: next(numbers, match[0]), heading)
        first = " ".join(numbers)
        begins = f", where it begins with {first}" if first else ""
        line = _PER_UNIT.sub("1", self.line)
        return f"`{line}`{begins}" + (f" below `{heading}`" if heading else "")


class ShownValue(Struct, frozen=True, omit_defaults=True):
    """What a lesson shows, and where: known again wherever its line has moved."""

    script: str
    before: str
    """The words before it, with `#` for numbers."""
    text: str
    nth: int = 0
    """Its index among those of the lesson that are the same in all of this."""
    count: int = 1
    """How many there are: with one more or less, it is uncertain which is which."""
    path: str = ""
    """That of the lesson; empty in its own record."""


Addresses: TypeAlias = dict[ShownValue, tuple[Address, ...]]
"""Where values were printed when they last held: each at all places that it may mean, which are
several where its author has chosen none."""


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
    code: str = ""
    """The hash of the script."""


def shown_versions(provenances: Iterable[Provenance | None]) -> tuple[str, ...]:
    """What pages say that scripts ran with; nothing where none ran."""
    packages: dict[str, None] = {}
    pythons: dict[str, None] = {}
    for made_with in provenances:
        if made_with is not None:
            packages |= dict.fromkeys(
                f"{proper_name(name)} {version}".strip() for name, version in made_with.packages
            )
            pythons[made_with.python] = None
    return (*sorted(packages), *sorted(filter(None, pythons)))


class Recorded(Struct, frozen=True, tag_field="is", tag="recording"):
    """How something was recorded."""

    of: str
    """The script, and which of its outputs or figures it is."""
    digest: str
    comparison: str
    """How it was to be compared, as its fence says it; for a figure, `figure`."""
    provenance: Provenance

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
        change = f"recorded with {old}, this is {new}"
        is_edited = before.code not in ("", now.code)  # this alone may explain what differs
        return f"the script was edited, and {change}" if is_edited else change


class _Bound(Struct, frozen=True, tag_field="is", tag="value"):
    """The line of a value."""

    value: ShownValue
    at: tuple[Address, ...]


class LessonRecord(Struct, frozen=True):
    """What such a file says, in the order of the lesson."""

    recordings: tuple[Recorded, ...] = ()
    addresses: Mapping[ShownValue, tuple[Address, ...]] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> LessonRecord:
        """The record in a text."""
        recordings: list[Recorded] = []
        addresses: Addresses = {}
        for line in text.split("\n"):
            try:
                entry = msgspec.json.decode(line, type=Recorded | _Bound)
            except (msgspec.DecodeError, UnicodeEncodeError):
                continue
            if isinstance(entry, Recorded):
                recordings.append(entry)
            else:  # two branches may have given it places: it may mean any
                places = (*addresses.get(entry.value, ()), *entry.at)
                addresses[entry.value] = tuple(dict.fromkeys(places))
        return cls(tuple(recordings), addresses)

    @property
    def text(self) -> str:
        """The file; empty where it would say nothing."""
        entries = (*self.recordings, *(_Bound(*item) for item in self.addresses.items()))
        lines = [f"\n{msgspec.json.encode(entry).decode()}\n" for entry in entries]
        return "".join((_HEAD, *lines)) if lines else ""

    def find(self, script: str, digest: str) -> Recorded | None:
        """How something of a script was recorded that has this hash now."""
        of_script = (r for r in self.recordings if r.of.startswith(f"{script} "))
        return next((r for r in of_script if r.digest == digest), None)


def shown_values(texts: Iterable[tuple[str, str, str, str]]) -> Iterator[ShownValue]:
    """Values from their path, script, words before and text, in the order of the lesson."""
    values = list(texts)
    counts, earlier = Counter(values), Counter[tuple[str, str, str, str]]()
    for value in values:
        path, script, before, text = value
        yield ShownValue(script, before, text, earlier[value], counts[value], path)
        earlier[value] += 1


def known_addresses(records: Mapping[str, LessonRecord]) -> Addresses:
    """The addresses in records by the path of their lesson."""
    return {
        replace(value, path=path): at
        for path, record in records.items()
        for value, at in record.addresses.items()
    }


def record_path(document: str) -> str:
    """The path of the record of a lesson or page, given its own."""
    return document.removesuffix(".md") + ENDING


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


def _changed(before: Provenance, now: Provenance, field: str) -> Iterator[tuple[str, str, str]]:
    """The packages of which another version is used now: name, recorded version, this one."""
    present = dict((*now.packages, *now.requirements))
    for name, version in getattr(before, field):
        if present.get(name, version) != version:
            yield proper_name(name), version, present[name]


def _join(words: Iterable[str]) -> str:
    *rest, last = words
    return f"{', '.join(rest)} and {last}" if rest else last
