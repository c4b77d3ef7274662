"""The account of an import: everything that the source holds, by kind: taken, changed or left.

A thing counts once: as taken where it is as it was, as changed where it says the same in another
way, and as left where something of it is missing in the new course, with what can be done.
"""

from __future__ import annotations

import json
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from textwrap import shorten

from msgspec import Struct

from coursebuild.api import regex
from coursebuild.report.values import plural

Replacement = Callable[[re.Match[str]], str]
Rules = tuple[tuple[re.Pattern[str], str | Replacement, str, str], ...]
"""What is replaced by what, the kind of thing that it is, and how it is changed."""


class Leftover(Struct, frozen=True, order=True):
    """Something that has no counterpart, or that the author has to look at."""

    path: str
    """The file, relative to the folder that is imported."""
    place: str
    """Where in the file, as `line 12` or `cell 3`; may be empty."""
    message: str
    """Why it is left, and what can be done."""
    kind: str = "file"

    @property
    def position(self) -> str:
        """The file, and the place in it."""
        return f"{self.path}, {self.place}" if self.place else self.path


_MOST_PLACES = 12
"""Places of one sort of leftover that are named."""
_MOST_LINES = 40
"""Lines on leftovers in a report of the command."""
_MOST_WORDS = 300
"""Characters of a message in a report of the command."""
_MOST_ALIKE = 3
"""Leftovers with the same words that it names one by one; else the first, and some places."""
_NAMES = regex(r"`[^`]*`|\(.*\)")
"""What differs in the messages on the same sort of thing."""


def shorten_value(value: object) -> str:
    """Return the beginning of a value of settings or metadata."""
    return shorten(value if isinstance(value, str) else json.dumps(value, default=str), 100)


class Account:
    """Collects what became of everything."""

    def __init__(self) -> None:
        self.taken: Counter[str] = Counter()
        self.changed: Counter[tuple[str, str]] = Counter()
        """How often something of a kind was changed in a way."""
        self._words: dict[tuple[str, str], list[str]] = defaultdict(list)
        """What a change leaves out, or what it puts in the place of what."""
        self._left: dict[Leftover, None] = {}

    @property
    def leftovers(self) -> list[Leftover]:
        """What is left, in the order of files and places."""

        def place(leftover: Leftover) -> tuple[str, list[int]]:
            return leftover.path, [int(number) for number in re.findall(r"\d+", leftover.place)]

        return sorted(self._left, key=place)

    def leave(self, leftover: Leftover) -> None:
        """Note that something is left; the same twice is one."""
        self._left[leftover] = None

    def change(self, kind: str, change: str, words: str) -> None:
        """Note that something of a kind was changed in a way, and the words that go by that."""
        self.changed[kind, change] += 1
        self._words[kind, change].append(" ".join(words.split()))

    def replace(
        self, text: str, old: re.Pattern[str], new: str | Replacement, kind: str, change: str
    ) -> str:
        """Return a text with what a pattern matches replaced, and note each as changed."""
        text, count = old.subn(new, text)
        self.changed[kind, change] += count
        return text

    def convert(self, kind: str, change: str, old: str, convert: Callable[[], str]) -> str:
        """Return what a part of a text becomes, and note what that is: kept, changed or left.

        It is left where a leftover of this kind is noted meanwhile.
        """
        before = len(self._left)
        new = convert()
        if any(leftover.kind == kind for leftover in [*self._left][before:]):
            return new
        if new.strip() == old.strip():
            self.taken[kind] += 1
        else:
            self.changed[kind, change] += 1
        return new

    def summary(self) -> Iterator[str]:
        """Yield the lines of a report: counts, then what is left, the first of many."""
        left, lines = self.leftovers, []
        counts = f"{self.taken.total()} taken, {self.changed.total()} changed, {len(left)} left"
        yield f"{counts}: IMPORT.md lists them by kind"
        groups = defaultdict[tuple[str, str], list[Leftover]](list)
        for leftover in left:
            groups[leftover.kind, _NAMES.sub("", leftover.message)].append(leftover)
        for alike in groups.values():
            examples = alike if len(alike) <= _MOST_ALIKE else alike[:1]
            lines += [f"left: {e.position}: {shorten(e.message, _MOST_WORDS)}" for e in examples]
            if rest := alike[len(examples) :]:
                places = "; ".join(leftover.position for leftover in rest[:_MOST_ALIKE])
                ellipsis = "; …" * (len(rest) > _MOST_ALIKE)
                lines.append(f"left: {len(rest)} more like this: {places}{ellipsis}")
        yield from lines[:_MOST_LINES]
        if lines[_MOST_LINES:]:
            yield f"left: {len(lines) - _MOST_LINES} more lines, which are in IMPORT.md"

    def text(self, name: str) -> str:
        """The text of IMPORT.md for a course that was called so."""
        self.taken, self.changed = +self.taken, +self.changed
        left = Counter(leftover.kind for leftover in self._left)
        changed: Counter[str] = Counter()
        for (kind, _), count in self.changed.items():
            changed[kind] += count
        lines = [
            f"# What was imported from {name}",
            "",
            "Nothing here is part of the course: read it, and delete it.",
            "",
            "| what | as it was | changed | left |",
            "| --- | ---: | ---: | ---: |",
        ]
        for kind in sorted({*self.taken, *changed, *left}):
            counts = (self.taken[kind], changed[kind], left[kind])
            lines.append(f"| {kind} | {' | '.join(str(count or '') for count in counts)} |")
        if self.changed:
            lines += ["", "## Changed", ""]
            for (kind, change), count in sorted(self.changed.items()):
                lines.append(f"- {kind}: {change} ({plural(count, 'time')})")
                lines += (f"  - {words}" for words in self._words[kind, change])
        if self._left:
            lines += ["", "## Left", ""]
        places = defaultdict[str, list[str]](list)
        for leftover in self.leftovers:
            places[leftover.message].append(leftover.position)
        for message, positions in places.items():
            lines.append(f"- {message}")
            lines += (f"  - {position}" for position in positions[:_MOST_PLACES])
            if rest := positions[_MOST_PLACES:]:
                lines.append(f"  - {len(rest)} more")
        return "\n".join(lines) + "\n"
