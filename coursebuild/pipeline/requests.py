"""What is asked of a `Reader`, and what it answers.

Entry points: `Read`, `Draw`; `Later`, a page that is put together when it is sent; `Drawn`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from coursebuild.core.values import decode
from coursebuild.pipeline.outlines import Task
from coursebuild.render.record import PageRecord
from coursebuild.render.search.values import Searched
from coursebuild.render.sheet import Sheet

if TYPE_CHECKING:
    from coursebuild.render.exports.files import PageByproducts

OUTLINES, PAGES, BYPRODUCTS, ITEMS = "outlines", "pages", "byproducts", "items"
"""Kinds of entries in the store. They stay on this machine, where they are made soon enough."""


class Read(Struct, frozen=True):
    """Read a text."""

    task: Task


class Draw(Struct, frozen=True):
    """Draw a page."""

    packed: bytes
    """Its sheet, as its key is made from it."""
    task: Task | None
    """The text of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    key: str
    """Under which it is kept."""

    @property
    def sheet(self) -> Sheet:
        """The sheet, read anew."""
        found = decode(self.packed, Sheet)
        assert found is not None
        return found


class Ask(Struct, frozen=True):
    """Make the items of a page's quizzes; they are kept under the page's key."""

    page: Draw


class Later:
    """A page of which only little is held until it is sent; it arrives as what is made of it."""

    __slots__ = ("make", "path")

    def __init__(self, path: str | None, make: Callable[[], Draw | Ask]) -> None:
        """`path` is that of its document, if it has one."""
        self.path = path
        self.make = make

    def __reduce__(self) -> tuple[Callable[[Draw | Ask], Draw | Ask], tuple[Draw | Ask]]:
        """The page itself."""
        return _same, (self.make(),)


def _same(request: Draw | Ask) -> Draw | Ask:
    return request


class Drawn(Struct, frozen=True):
    """A page that was drawn."""

    record: PageRecord
    body: str
    searched: Searched | None
    """What it is found by; `None` where it is not searched."""
    byproducts: PageByproducts
    """What it gives to the files beside it."""


Request: TypeAlias = Read | Draw | Ask | Later
Answer: TypeAlias = bytes
"""The outline of what was read; the packed record of the page that was drawn; the packed
items of its quizzes."""
