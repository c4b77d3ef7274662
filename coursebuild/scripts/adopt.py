"""An edit made in an extracted file, brought back into the lesson's block.

Entry point: `adopted(script, data)`.
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

    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return refused("it is not UTF-8")
    lines = re.split(r"\r\n|\r|\n", text)
    while lines and not lines[-1]:
        lines.pop()
    if not lines:
        return refused("it is empty")
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
