"""What a lesson is made of, before it is written for one generator of sites.

Texts are Markdown with formulas in dollar signs, links in the form `[text](lesson:1.2)` and numbers
bound to an output as `` `4.91`{out} ``; a flavor replaces the last two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias


@dataclass(frozen=True, slots=True)
class Callout:
    """A titled box."""

    kind: str
    title: str
    folded: bool
    text: str


@dataclass(frozen=True, slots=True)
class Script:
    """A complete script and what it prints."""

    path: str
    """Relative to the course's root."""
    code: str
    output: str


@dataclass(frozen=True, slots=True)
class InOut:
    """What the script takes, does and gives."""

    takes: str
    does: str
    gives: str


@dataclass(frozen=True, slots=True)
class Question:
    """A question of a quiz."""

    data: dict[str, Any]
    """As the JSON of coursebuild has it."""
    answer: str
    """In words."""


@dataclass(frozen=True, slots=True)
class Quiz:
    """A quiz."""

    questions: tuple[Question, ...]


Piece: TypeAlias = str | Callout | Script | InOut | Quiz
"""A text is a heading, a paragraph, a list, a table or a displayed formula."""


@dataclass(frozen=True, slots=True)
class Lesson:
    """One lesson with its entry in the course map."""

    number: int
    """From 0."""
    id: str
    slug: str
    title: str
    summary: str
    prerequisites: tuple[str, ...]
    pieces: tuple[Piece, ...]

    @property
    def name(self) -> str:
        """Of its file, without the ending."""
        return f"{self.id}-{self.slug}"
