"""Which questions a document asks, as the lists of lessons name them for the page's script.

Entry points: `asked(document)`, for one document; `AskedBy`, for all of a course.

From it the script knows, without another page, how many questions a lesson has, whether all are
answered right, and where to find one that is to be reviewed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias
from urllib.parse import quote

from coursebuild.model import Document, Quiz, document_blocks

AskedBy: TypeAlias = Mapping[str, str]
"""By the path of the document; those that ask nothing are left out."""


def asked(document: Document) -> str:
    """`ID:KEY,KEY ID:KEY`: each quiz with the keys of its questions; ids are percent-encoded."""
    quizzes = (block for block in document_blocks(document) if isinstance(block, Quiz))
    return " ".join(f"{quote(quiz.id, safe='')}:{','.join(quiz.keys)}" for quiz in quizzes)


def count(text: str) -> int:
    """How many questions `asked` names."""
    return sum(len(part.partition(":")[2].split(",")) for part in text.split(" ")) if text else 0
