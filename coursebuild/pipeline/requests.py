"""What is asked of a `Reader`, and what it answers.

Entry points: `Read`, `Draw`; `Later`, a page that is put together when it is sent.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from coursebuild.pipeline.outlines import Task
from coursebuild.render.fonts import FontJob
from coursebuild.render.sheet import Sheet
from coursebuild.values import dataclass

OUTLINES, PAGES = "outlines", "pages"
"""Kinds of entries in the store. They stay on this machine: reading them may run code."""


@dataclass(frozen=True, slots=True)
class Read:
    """Read a text."""

    task: Task


@dataclass(frozen=True, slots=True)
class Draw:
    """Draw a page."""

    sheet: Sheet
    task: Task | None
    """The text of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    key: str
    """Under which it is kept."""


@dataclass(frozen=True, slots=True)
class Cut:
    """Cut a font."""

    job: FontJob


class Later:
    """A page of which only little is held until it is sent; it arrives as `Draw`."""

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


Request: TypeAlias = Read | Draw | Later | Cut
Answer: TypeAlias = bytes
"""The outline of what was read; the packed record of the page that was drawn; the font."""
