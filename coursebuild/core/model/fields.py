"""Types of fields that several declarations share, and who wrote a course, and ways through it.

In the `extra` of a `Meta` are two remarks for the decoder: `text` ("blocks" or "inlines": the
string is Markdown; "number": it may be a number that is bound) and `expects` (words for what the
pattern or the bounds allow). Any other text without a pattern is plain, and may bind numbers.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct

NOT_BLANK = r"\S"

_MARKDOWN: dict[str, Any] = {"contentMediaType": "text/markdown"}

Text: TypeAlias = Annotated[str, Meta(pattern=NOT_BLANK)]

Blocks: TypeAlias = Annotated[
    str, Meta(pattern=NOT_BLANK, extra={"text": "blocks"}, extra_json_schema=_MARKDOWN)
]

OptionalBlocks: TypeAlias = Annotated[
    str, Meta(extra={"text": "blocks"}, extra_json_schema=_MARKDOWN)
]

Inlines: TypeAlias = Annotated[
    str, Meta(pattern=NOT_BLANK, extra={"text": "inlines"}, extra_json_schema=_MARKDOWN)
]

BoundFloat: TypeAlias = Annotated[
    float, Meta(extra={"text": "number"}, extra_json_schema={"type": ["number", "string"]})
]
"""A number, or a text that binds one to what a script printed, as in `` `1.42`{out} ``."""

Positive: TypeAlias = Annotated[float, Meta(gt=0)]
NotNegative: TypeAlias = Annotated[float, Meta(ge=0)]
BELOW_ONE = Meta(lt=1, extra={"expects": "a share of the number; 1 would take 0 for it"})
RelativeTolerance: TypeAlias = Annotated[NotNegative, BELOW_ONE]
Digits: TypeAlias = Annotated[int, Meta(ge=0, le=15)]


def describe(description: str, **bounds: Any) -> Meta:
    """What a field is for, as editors show it, and what else a `Meta` holds."""
    return Meta(description=description, **bounds)


def matching(pattern: str, expects: str) -> Meta:
    """The pattern that a string must match, and the words for it in messages."""
    return Meta(pattern=pattern, extra={"expects": expects})


Language: TypeAlias = Annotated[
    str, matching(r"^[A-Za-z]{2,3}(-[A-Za-z0-9]{2,8})*$", "a language tag, as in `en` or `pt-BR`")
]
"""Of a text and of the interface."""

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


Orcid: TypeAlias = Annotated[
    str,
    matching(
        r"^[0-9]{4}-[0-9]{4}-[0-9]{4}-[0-9]{3}[0-9X]$", "an ORCID iD, as in `0000-0002-1825-0097`"
    ),
]


class Author(Struct, frozen=True, forbid_unknown_fields=True):
    """Who wrote the course."""

    name: Annotated[str, Meta(pattern=NOT_BLANK), describe("as it is to be cited")]
    orcid: Annotated[Orcid | None, describe("their [ORCID iD](https://orcid.org)")] = None

    @property
    def address(self) -> str:
        """That of the ORCID iD; empty without one."""
        return f"https://orcid.org/{self.orcid}" if self.orcid else ""

    @property
    def card(self) -> str:
        """Who it is for a learning platform (RFC 2426, vCard 3.0)."""
        name = re.sub(r"([\\;,])", r"\\\1", self.name)
        url = f"URL:{self.address}\r\n" if self.address else ""
        return f"BEGIN:VCARD\r\nVERSION:3.0\r\nFN:{name}\r\nN:{name}\r\n{url}END:VCARD"

    @property
    def is_misspelt(self) -> bool:
        """Whether the last digit of the ORCID iD does not follow from the others (ISO 7064)."""
        total = 0
        digits = (self.orcid or "").replace("-", "")
        for digit in digits[:-1]:
            total = (total + int(digit)) * 2
        return bool(digits) and digits[-1] != "0123456789X"[(12 - total % 11) % 11]


class CoursePath(Struct, frozen=True, forbid_unknown_fields=True):
    """A way through the course, for one kind of reader."""

    title: Annotated[Text, describe("plain text")]
    lessons: Annotated[tuple[Text, ...], describe("ids of lessons in the order of reading")]
    summary: Annotated[str, describe("for whom it is, or where it leads")] = ""
    picture: Annotated[
        Text | None, describe("the lesson whose picture it has; otherwise the last with one")
    ] = None


class Silence(Struct, frozen=True, forbid_unknown_fields=True):
    """A warning that is not shown."""

    rule: Annotated[str, describe("the name of a warning or a hint", pattern=r"\S")]
    reason: Annotated[str, describe("why")] = ""
    path: Annotated[
        Annotated[str, Meta(pattern=r"\S")] | None,
        describe("only in these files; `*` and `?` stand for anything"),
    ] = None
