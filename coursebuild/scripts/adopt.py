"""An edit made in an extracted file, brought back into the lesson's block.

Entry points: `adopted(script, data)`; `block_text(data)`, what a block can hold of a file.
"""

from __future__ import annotations

import re

from coursebuild.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.model import Script


def adopted(script: Script, data: bytes) -> Edit | Diagnostic:
    """What to write into the block so that it extracts to `data`; a diagnostic where it cannot be.

    The lesson's line ends and what stands before each line of the block are kept.
    """

    def refused(why: str) -> Diagnostic:
        message = f"{script.path} cannot be brought into the lesson: {why}"
        return diagnose("example-edited", script.path_span, message, help="bring it over by hand")

    text = block_text(data)
    if text is None:
        return refused("it is not UTF-8")
    if text == "\n":
        return refused("it is empty")
    lines = text.removesuffix("\n").split("\n")
    opening = re.search(r"`{3,}|~{3,}", script.span.first_line().text)
    fence = opening.group() if opening else "```"
    closing = re.compile(rf" {{0,3}}{re.escape(fence[0])}{{{len(fence)},}}[ \t]*")
    if any(closing.fullmatch(line) for line in lines):
        return refused("one of its lines would close the fence")
    if "\0" in text:
        return refused("it holds a NUL")
    newline = "\r\n" if "\r\n" in script.span.text else "\n"
    written = [f"{script.prefix}{line}" if line else script.prefix.rstrip() for line in lines]
    return Edit(script.body_span, "".join(line + newline for line in written))


def block_text(data: bytes) -> str | None:
    """A file as a block can hold it; `None` where it is not UTF-8.

    Without a byte order mark, with LF line ends, and one at the end.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n") + "\n"
