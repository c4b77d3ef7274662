"""What the search finds of a quiz. Answers and explanations are left out: it gives none away."""

from __future__ import annotations

from typing import TYPE_CHECKING

from coursebuild.features.quiz.model import ChoiceQuestion, OrderQuestion, Quiz

if TYPE_CHECKING:
    from coursebuild.core.features import IndexReader


def index_quiz(reader: IndexReader, quiz: Quiz) -> None:
    """Its title, its questions, and what there is to choose from."""
    reader.add("text", quiz.title)
    for question in quiz.questions:
        reader.blocks(question.text)
        if isinstance(question, ChoiceQuestion):
            for option in question.options:
                reader.add("text", reader.text(option.text))
        elif isinstance(question, OrderQuestion):
            # In the order of their texts: how they are written is the answer.
            for text in sorted(map(reader.text, question.items)):
                reader.add("text", text)
