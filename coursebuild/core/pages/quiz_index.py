"""Quiz indexes: the questions of a document, listed for the scripts of other pages.

Entry points: `quiz_index(document)`; `count`, the number of questions in it.

From the index a script knows, without loading the lesson, how many questions it has, whether all
were answered right, and where to find one to review.
"""

from __future__ import annotations

from urllib.parse import quote

from coursebuild.core.model import Document, FeatureBlock, document_blocks


def quiz_index(document: Document) -> str:
    """`ID:KEY,KEY ID:KEY`: each quiz with the keys of its questions; ids are percent-encoded."""
    blocks = (block for block in document_blocks(document) if isinstance(block, FeatureBlock))
    quizzes = (keys for block in blocks if (keys := block.progress_keys()) is not None)
    return " ".join(f"{quote(id, safe='')}:{','.join(keys)}" for id, keys in quizzes)


def count(text: str) -> int:
    """The number of questions in a quiz index."""
    return sum(len(part.partition(":")[2].split(",")) for part in text.split(" ")) if text else 0
