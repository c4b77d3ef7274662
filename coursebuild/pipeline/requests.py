"""What is asked of a `Reader`, and what it answers.

Entry points: `Read`, `Draw`.
"""

from __future__ import annotations

from typing import TypeAlias

from coursebuild.pipeline.outlines import Task
from coursebuild.render.fonts import FontJob
from coursebuild.render.record import PageRecord
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


Request: TypeAlias = Read | Draw | Cut
Answer: TypeAlias = bytes | PageRecord
"""The outline of what was read, or the font, as bytes; the record of the page that was drawn."""
