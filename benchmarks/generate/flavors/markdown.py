"""The pieces in the dialects of Markdown that the peers read.

Entry point: `Dialect.lesson`. A dialect says how a callout is written and where a lesson lies; what
no peer has, a quiz, is written with what each of them has: lists and folded callouts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.generate.document import (
    Callout,
    InOut,
    Lesson,
    Piece,
    Question,
    Quiz,
    Script,
)
from benchmarks.generate.flavors.common import plain


@dataclass(frozen=True, slots=True)
class Dialect:
    """How one peer's Markdown differs from the others'."""

    callout: Callable[[str, str, bool, str], str]
    """From kind, title, whether it starts folded, and body."""
    address: Callable[[str], str]
    """From a lesson's id to what a link to it says."""
    code: Callable[[str, str], str] = lambda language, text: f"```{language}\n{text}```"

    def lesson(self, lesson: Lesson) -> str:
        """The body of a lesson, without its title."""
        return "\n\n".join(self.piece(piece) for piece in lesson.pieces) + "\n"

    def piece(self, piece: Piece) -> str:
        """One piece."""
        match piece:
            case str():
                return plain(piece, self.address)
            case Callout(kind, title, folded, text):
                return self.callout(kind, title, folded, plain(text, self.address))
            case Script(path, code, output):
                output_block = self.code("text", output)
                return f"`{path}`\n\n{self.code('python', code)}\n\nOutput:\n\n{output_block}"
            case InOut(takes, does, gives):
                rows = ("Input", takes), ("Process", does), ("Output", gives)
                return "| | |\n| --- | --- |\n" + "\n".join(f"| {a} | {b} |" for a, b in rows)
            case Quiz(questions):
                return "\n\n".join(self.question(question) for question in questions)

    def question(self, question: Question) -> str:
        """One question, and its answer in a folded callout."""
        options = "\n".join(f"- {option}" for option in question.data.get("options", ()))
        answer = self.callout("tip", "Answer", True, question.answer)
        return "\n\n".join(filter(None, (question.data["q"], options, answer)))
