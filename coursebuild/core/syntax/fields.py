"""Types of fields that several declarations share.

Entry points: `Text`, `Blocks`, `Inlines`, `OptionalBlocks`, `Positive`, `NotNegative`.

What a type adds to its plain Python type stands in `Meta`: bounds and patterns, which the decoder
and the JSON Schemas both read, and in `extra` two remarks for the decoder alone: `text` ("blocks"
or "inlines": the string is Markdown) and `expects` (what a string that does not match the pattern
should have been).
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from msgspec import Meta

NOT_BLANK = r"\S"
"""The pattern of a text that must say something."""

_MARKDOWN: dict[str, Any] = {"contentMediaType": "text/markdown"}

Text: TypeAlias = Annotated[str, Meta(pattern=NOT_BLANK)]
"""Plain text that says something."""

Blocks: TypeAlias = Annotated[
    str, Meta(pattern=NOT_BLANK, extra={"text": "blocks"}, extra_json_schema=_MARKDOWN)
]
"""Markdown of any length."""

OptionalBlocks: TypeAlias = Annotated[
    str, Meta(extra={"text": "blocks"}, extra_json_schema=_MARKDOWN)
]
"""Markdown of any length, or nothing."""

Inlines: TypeAlias = Annotated[
    str, Meta(pattern=NOT_BLANK, extra={"text": "inlines"}, extra_json_schema=_MARKDOWN)
]
"""Markdown that fits into a line."""

Positive: TypeAlias = Annotated[float, Meta(gt=0)]
NotNegative: TypeAlias = Annotated[float, Meta(ge=0)]
Digits: TypeAlias = Annotated[int, Meta(ge=0, le=15)]
"""Decimal places."""
