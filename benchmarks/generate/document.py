"""What a lesson is made of, before it is written for one generator of sites.

Texts are Markdown with formulas in dollar signs, links in the form `[text](lesson:1.2)` and numbers
bound to an output as `` `4.91`{out} ``; a flavor replaces the last two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading below the lesson's title."""

    level: int
    text: str


@dataclass(frozen=True, slots=True)
class Prose:
    """A paragraph, a list or a table."""

    text: str


@dataclass(frozen=True, slots=True)
class Display:
    """A displayed formula."""

    tex: str


@dataclass(frozen=True, slots=True)
class Callout:
    """A titled box."""

    kind: str
    title: str
    folded: bool
    body: tuple[Prose | Display, ...]


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
class Choice:
    """A question with options."""

    text: str
    options: tuple[str, ...]
    answer: int
    explain: str


@dataclass(frozen=True, slots=True)
class Number:
    """A question whose answer is a number."""

    text: str
    answer: float
    explain: str


@dataclass(frozen=True, slots=True)
class Open:
    """A question that is answered in words."""

    text: str
    reference: str


@dataclass(frozen=True, slots=True)
class OutputQuestion:
    """A question about one line of the output of the lesson's script."""

    text: str
    line: int
    """From 1."""
    answer: str


Question: TypeAlias = Choice | Number | Open | OutputQuestion


@dataclass(frozen=True, slots=True)
class Quiz:
    """A quiz."""

    questions: tuple[Question, ...]


Piece: TypeAlias = Heading | Prose | Display | Callout | Script | InOut | Quiz


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
