"""What a page is found by.

Entry points: `PageText`, `Section`, `SectionPiece`; `Searched`, the same as bytes.
"""

from __future__ import annotations

import hashlib
from typing import Literal

from msgspec import Struct

Kind = Literal["text", "code", "formula", "output"]


class SectionPiece(Struct, frozen=True):
    """A paragraph, a listing, a formula, an output."""

    kind: Kind
    text: str


class Section(Struct, frozen=True):
    """What stands between a heading and the next."""

    anchor: str
    """Of its heading; empty for what stands before the first."""
    heading: str
    level: int
    """Of its heading, from 1; 0 where there is none."""
    pieces: tuple[SectionPiece, ...]
    also: tuple[str, ...] = ()
    """Texts that it is found by and that are not shown: names of TeX commands, of files."""


class PageText(Struct, frozen=True):
    """A page as it is searched."""

    title: str
    name: str
    """What the page is called for short, as `4.2`; often empty."""
    sections: tuple[Section, ...]


class Searched(Struct, frozen=True):
    """What a page gives to the search."""

    name: str
    """See `PageText`."""
    text: bytes
    """The file that a browser loads to show what it found."""
    terms: bytes
    """See `page.terms`."""

    @property
    def digest(self) -> str:
        """Of text and terms."""
        whole = hashlib.sha256(b"%d " % len(self.text))
        whole.update(self.text)
        whole.update(self.terms)
        return whole.hexdigest()[:32]
