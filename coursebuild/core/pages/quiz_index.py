"""Which questions a document asks, as the lists of lessons name them for the page's script.

Entry points: `quiz_index(document)`; `count`, of the questions in it.

From it the script knows, without another page, how many questions a lesson has, whether all are
answered right, and where to find one that is to be reviewed.
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
    """How many questions `quiz_index` names."""
    return sum(len(part.partition(":")[2].split(",")) for part in text.split(" ")) if text else 0
