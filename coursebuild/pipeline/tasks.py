"""What is asked of a `Reader`, and what it answers and keeps.

Entry points: `Task`, a text to parse, and what is known of it then, its `DocumentSummary`; `Draw`,
a page to draw; `Later`, a page that is put together when it is sent; `Drawn`, and `KeptPage`, the
same in the memo.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import msgspec
from msgspec import Struct

from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Document
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.record import PageRecord
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.core.values import decode, encode

SUMMARIES, PAGES = "summaries", "pages"
"""Kinds of entries in the store. They stay on this machine, where they are made soon enough."""


# --- reading


class Task(Struct, frozen=True):
    """Parse a text."""

    source: Source
    callouts: frozenset[str]
    lesson: bool
    key: str
    """A hash of all that its summary depends on."""

    @classmethod
    def of(cls, source: Source, callouts: frozenset[str], lesson: bool) -> Task:
        """With its key."""
        key = step_key("summary", lesson, callouts, source.path, source.digest)
        return cls(source, callouts, lesson, key)

    def is_of(self, source: Source, callouts: frozenset[str], lesson: bool) -> bool:
        """Whether it is the task of these."""
        same = self.callouts == callouts and self.lesson == lesson
        return same and (self.source is source or self.source == source)


class DocumentSummary(Struct, frozen=True):
    """A parsed text: what others than its own page look at, and what is wrong in it."""

    document: Document
    """Without its prose; see `model.summary`."""
    diagnostics: tuple[Diagnostic, ...]
    """Those of formulas among them."""
    imports: tuple[tuple[str, tuple[str, ...]], ...]
    """Paths of scripts, each with the modules that it imports."""
    lasting: bool
    """Whether the same text gives the same again."""
    fingerprint: str = ""
    """Of what others than its own page can see of it; see `pipeline.fingerprints`."""


def all_imports(summaries: Iterable[DocumentSummary]) -> dict[str, frozenset[str]]:
    """Modules by the path of the script that imports them."""
    return {path: frozenset(modules) for summary in summaries for path, modules in summary.imports}


# --- drawing


class Draw(Struct, frozen=True):
    """Draw a page."""

    packed: bytes
    """Its inputs, as its key is made from it."""
    task: Task | None
    """The text of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    key: str
    """Under which it is kept."""

    @property
    def inputs(self) -> PageInputs:
        """The inputs, read anew."""
        found = decode(self.packed, PageInputs)
        assert found is not None
        return found


class Later:
    """A page of which only little is held until it is sent; it arrives as a `Draw`."""

    __slots__ = ("make", "path")

    def __init__(self, path: str | None, make: Callable[[], Draw]) -> None:
        """`path` is that of its document, if it has one."""
        self.path = path
        self.make = make

    def __reduce__(self) -> tuple[Callable[[Draw], Draw], tuple[Draw]]:
        """The page itself."""
        return _same, (self.make(),)


def _same(request: Draw) -> Draw:
    return request


class Drawn(Struct, frozen=True):
    """A page that was drawn."""

    record: PageRecord
    body: str
    notes: dict[str, bytes]
    """See `page_notes`."""


Request: TypeAlias = Task | Draw | Later
Answer: TypeAlias = bytes
"""The summary of what was read; the packed record of the page that was drawn."""


class KeptPage(Struct, frozen=True, array_like=True):
    """A page in the store."""

    packed_record: bytes
    notes: dict[str, bytes]
    """See `page_notes`."""
    body: bytes
    """UTF-8."""

    @classmethod
    def of(cls, drawn: Drawn) -> KeptPage:
        """A page that was drawn just now."""
        return cls(encode(drawn.record), drawn.notes, drawn.body.encode())

    @classmethod
    def read(cls, data: bytes | None) -> KeptPage | None:
        """The page; `None` where the bytes are none."""
        try:
            return None if data is None else msgspec.msgpack.decode(data, type=cls)
        except msgspec.MsgspecError:
            return None

    @property
    def record(self) -> PageRecord | None:
        """What the site must know of it; `None` where the bytes are none."""
        return decode(self.packed_record, PageRecord)
