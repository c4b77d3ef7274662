"""`lab` fences, and what an author is told of them."""

from __future__ import annotations

from coursebuild.core.model import document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from coursebuild.features.lab.model import Lab
from support.positioned_nodes import format_diagnostics


def parse(body: str, kind: str = "simlab") -> Parsed[Lab | None]:
    """The lab whose JSON begins in the second line of a lesson."""
    source = Source("content/lessons/4.2-x.md", f"```lab {kind}\n{body}\n```\n")
    result = parse_document(source, frozenset(), lesson=True)
    labs = (block for block in document_blocks(result.value) if isinstance(block, Lab))
    return Parsed(next(labs, None), result.diagnostics)


def messages(body: str, kind: str = "simlab") -> list[str]:
    return format_diagnostics(parse(body, kind).diagnostics)
