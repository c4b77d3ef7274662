"""MJCF blocks: a model or a fragment of one, or a model that must not compile.

Entry point: `parse_mjcf`. Keys: `fragment="worldbody"` (where the fragment goes; `worldbody/body`
names nested elements), `error="…"` (the message it must fail with).
"""

from __future__ import annotations

from coursebuild.core.model import CodeBlock, Mjcf
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.info import parse_info, read_keys
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.patterns import pattern

_ELEMENTS = pattern(r"[A-Za-z_][\w-]*(?:/[A-Za-z_][\w-]*)*")


def parse_mjcf(fence: Fence) -> Parsed[Mjcf | CodeBlock]:
    """An `mjcf` fence; one that says in a wrong way what it is cannot be compiled, and is code."""
    info = parse_info(fence.info)
    keys = read_keys("mjcf", info.value.words, values=("fragment", "error"))
    diagnostics = [*info.diagnostics, *keys.diagnostics]
    fragment, error = keys.value.get("fragment"), keys.value.get("error")
    if fragment is not None and not _ELEMENTS.fullmatch(fragment.value or ""):
        message = f"`{fragment.value}` is not the name of an element"
        help = 'name the element that it goes into, for example `fragment="worldbody"`'
        diagnostics.append(diagnose("fence-key-value", fragment.value_span, message, help=help))
    if diagnostics:
        return Parsed(fence.code(), tuple(diagnostics))
    mjcf = Mjcf(
        fence.span,
        fence.body,
        None if fragment is None else fragment.value,
        None if error is None else error.value,
        None if error is None else error.value_span,
    )
    return Parsed(mjcf)
