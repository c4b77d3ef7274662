"""Types of fields that several declarations share.

Entry points: `Text`, `Blocks`, `Inlines`, `OptionalBlocks`, `Positive`, `NotNegative`, `Digits`,
`Slug`, `WebPlace`, `matching`.

`Meta` holds what a type adds to its plain Python type: bounds and patterns, which the decoder and
the JSON Schemas both read, and in `extra` two remarks for the decoder only: `text` ("blocks" or
"inlines": the string is Markdown) and `expects` (words for the strings that the pattern allows).
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from msgspec import Meta

NOT_BLANK = r"\S"
"""The pattern of a text that must not be blank."""

_MARKDOWN: dict[str, Any] = {"contentMediaType": "text/markdown"}

Text: TypeAlias = Annotated[str, Meta(pattern=NOT_BLANK)]
"""Plain text, not blank."""

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


def matching(pattern: str, expects: str) -> Meta:
    """The pattern that a string must match, and the words for it in messages."""
    return Meta(pattern=pattern, extra={"expects": expects})


WebPlace: TypeAlias = Annotated[
    str,
    matching(
        r"^https?://[^\s/@?#]+(/[^\s?#]*)?$",
        "an address that begins with `https://` or `http://`, without a user, `?` and `#`",
    ),
]
Slug: TypeAlias = Annotated[
    str,
    matching(
        r"^[a-z0-9]+(-[a-z0-9]+)*$",
        "lower-case letters and digits in words joined by single hyphens",
    ),
]
