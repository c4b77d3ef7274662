"""What running an imported course shows, in the order in which its author wants to read it.

First what its own numbers contradict, then what cannot run, then what was changed. It is written
into the account in one step with the lessons that it is about: after an interruption nothing of it
is missing, although what was replaced is replaced by then.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.api import Diagnostic, Edit, Options, Source, Span
from coursebuild.core.files.write import FileChange
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.features.importer.convert import change_tried_lessons
from coursebuild.pipeline.recordings import read_recorded

ACCOUNT = "IMPORT.md"
_SHOWN = "\n## What running showed\n\n"
_WRONG = "\n## What does not hold\n\n"
_MOST_LINES = 40
"""Findings that a report of the command names one by one."""


class Rank(enum.IntEnum):
    """How much an author wants to know it; the lowest first."""

    SAID = 0
    """A text says a number that is printed no more."""
    RECORDED = 1
    """A recorded output does not hold."""
    FAILED = 2
    """A cell cannot run, and no missing module is the reason."""
    LIKELY = 3
    """A text says another number than is printed with the same words: perhaps of something else."""
    MISSING = 4
    """A cell cannot run without a module."""
    CHANGED = 5
    """Something was written."""
    DRAWN = 6
    """A figure was; only the report says so."""


class _Finding(Struct):
    rank: Rank
    message: str
    path: str = ""
    at: int = 0
    """Its place in the file as it is now."""


class Findings:
    """Collects what running shows, and writes it beside the lessons."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self._items: list[_Finding] = []
        self._texts: dict[str, str] = {}
        old = (read_recorded(options.root, ACCOUNT) or b"").decode("utf-8", "replace")
        self._old_lines = old.partition(_SHOWN)[2].splitlines()
        """What was found before."""

    def add(self, rank: Rank, message: str, place: Span | None = None) -> None:
        """Add a finding; its place stands before the message, which begins with a sign or blank."""
        item = _Finding(rank, message)
        if place is not None:
            item.path, item.at = place.path, place.start
            self._texts[place.path] = place.source.text
        if item not in self._items:
            self._items.append(item)

    def remarks(self) -> Iterator[str]:
        """Yield the lines of the command's report, the first of many."""
        lines = [*self._lines()]
        yield from lines[:_MOST_LINES]
        if rest := lines[_MOST_LINES:]:
            yield f"{len(rest)} more, which are in {ACCOUNT}"

    def write(
        self, edits: Mapping[Source, Sequence[Edit]], errors: Iterable[Diagnostic] = ()
    ) -> None:
        """Make edits of lessons, and bring the account up to date, all or nothing.

        `errors` are what a check finds after that.
        """
        changes = []
        for source, own_edits in edits.items():
            new = apply_edits(source.text, own_edits)
            changes.append(FileChange.of(source, new))
            for item in self._items:
                item.at = _place_after(item.at, own_edits) if item.path == source.path else item.at
            self._texts[source.path] = new
        account = self._account(errors)
        changes = [change for change in (*changes, *account) if change.new != change.old]
        change_tried_lessons(self.options.root, changes, self.options.store)

    def _lines(self, last: Rank = Rank.DRAWN) -> Iterator[str]:
        items = (item for item in self._items if item.rank <= last)
        for item in sorted(items, key=lambda item: item.rank):
            place = ""
            if item.path:
                place = f"{item.path}:{self._texts[item.path].count(chr(10), 0, item.at) + 1}"
            yield f"{place}{item.message}"

    def _account(self, errors: Iterable[Diagnostic]) -> Iterator[FileChange]:
        old = read_recorded(self.options.root, ACCOUNT)
        if old is None:
            return
        text = old.decode("utf-8", "replace")
        new = min(text.partition(_SHOWN)[0], text.partition(_WRONG)[0], key=len)
        lines = [f"- {d.span.path}:{d.span.line}: {d.message}\n" for d in errors if d.is_error]
        if lines:
            new += _WRONG + "".join(lines)
        lines = [f"- {line}" for line in self._lines(Rank.CHANGED)]
        known_lines = {*map(_without_lines, lines)}
        lines += (line for line in self._old_lines if _without_lines(line) not in known_lines)
        if lines:
            new += _SHOWN + "".join(f"{line}\n" for line in lines)
        yield FileChange(ACCOUNT, old, new.encode())


def _place_after(at: int, edits: Iterable[Edit]) -> int:
    """Return where a place of a text is after edits; one that is replaced begins anew."""
    shift = 0
    for edit in sorted(edits, key=lambda edit: edit.span.start):
        if edit.span.end <= at and edit.span.start < at:
            shift += len(edit.text) - (edit.span.end - edit.span.start)
        elif edit.span.start <= at:
            return edit.span.start + shift
    return at + shift


def _without_lines(text: str) -> str:
    return re.sub(r"(\.md):\d+", r"\1", text)
