"""Functions that the flavors share."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path


def write_text(path: Path, text: str) -> None:
    """Write a file and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def indent(text: str, by: str = "    ") -> str:
    """The text with every line indented that is not empty."""
    return "\n".join(by + line if line else line for line in text.split("\n"))


def quote(text: str) -> str:
    """The text as a blockquote."""
    return "\n".join(f"> {line}".rstrip() for line in text.split("\n"))


def plain(text: str, address: Callable[[str], str]) -> str:
    """Prose without what only coursebuild knows: bound numbers, links by id.

    The address of a lesson follows from its id.
    """
    text_with_links = re.sub(r"\]\(lesson:([0-9.]+)\)", lambda m: f"]({address(m[1])})", text)
    return text_with_links.replace("`{out}", "`")
