"""Fences become blocks according to their kind.

Entry point: `read_block`. Scripts are read in `script`, fences of features by the features.

`mjcf` is a kind of the core, a model or a fragment of one. Keys: `fragment="worldbody"` (where the
fragment goes; `worldbody/body` names nested elements), `error="…"` (the message it must fail with).
"""

from __future__ import annotations

import re

from coursebuild.core.features import FenceKind
from coursebuild.core.model import Block, CodeBlock, FeatureBlock, Mjcf, Script
from coursebuild.core.registry import fence_kind
from coursebuild.core.syntax.fence import Fence, check_kind, find_likely_end, find_likely_start
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.recording import check_stray_keys, record_fence
from coursebuild.core.syntax.script import parse_python
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Note, diagnose

_HEAD_RULES = frozenset(
    {"fence-info", "fence-key-repeated", "fence-key-unknown", "fence-key-value", "script-path"}
)
"""Mistakes that may be why a block is no script."""


def read_block(fence: Fence, state: ParsingState, texts: TextParser) -> Block:
    """The block of a fence; recorded outputs are read in `recording`."""
    if not fence.is_closed or fence.inner is not None:
        return _read_unclosed(fence, state)
    match fence.kind:
        case "python":
            return _read_script(fence, state)
        case "output" if fence.nested:
            message = "a text of a quiz or lab cannot hold a recorded output"
            state.report(diagnose("fence-info", fence.head, message))
            return fence.code()
        case "output":
            return record_fence((), fence.head, fence, state) or fence.code()
        case "text":
            check_stray_keys(fence, state)
            return fence.code()
        case "mjcf":
            return _read_mjcf(fence, state)
        case name if (kind := fence_kind(name)) is not None:
            return _read_feature_block(kind, fence, state, texts)
        case _:
            state.diagnostics += check_kind(fence)
            return fence.code()


def _read_unclosed(fence: Fence, state: ParsingState) -> CodeBlock:
    """Report a fence without end, and show it as code; its content is not checked."""
    if state.closes_indented and not fence.info.text:
        state.closes_indented = False
        return fence.code()
    marks = fence.head.text[: len(fence.head.text) - len(fence.head.text.lstrip("`~"))]
    name = "backticks" if marks[0] == "`" else "tildes"
    help = f"close it with a line of {len(marks)} {name} in the same quote or list item"
    message, notes = "this code fence is never closed", []
    if fence.inner is not None:
        message = "this code fence is not closed before another one begins"
        notes = [Note("this line is read as text of the fence above it", fence.inner)]
    likely_end = find_likely_end(fence)
    likely_start = None if fence.info.text else find_likely_start(fence.head)
    if likely_end is not None:
        notes.append(Note("its block seems to end here", likely_end))
    if likely_start is not None:
        notes.append(Note("or a block that begins here has lost its first line", likely_start))
    state.report(diagnose("fence-unclosed", fence.head, message, help=help, notes=notes))
    if fence.kind == "python" or fence.inner is not None:
        state.script, state.has_invalid_script = None, True
    return fence.code()


def _read_script(fence: Fence, state: ParsingState) -> Block:
    parsed_block = parse_python(fence)
    state.diagnostics += parsed_block.diagnostics
    if isinstance(parsed_block.value, Script):
        state.script, state.has_invalid_script = parsed_block.value.path, False
        names = (figure.name for figure in parsed_block.value.figures)
        state.figures += [name for name in names if not name.endswith(".csv")]
    elif not fence.nested and any(d.rule in _HEAD_RULES for d in parsed_block.diagnostics):
        state.script, state.has_invalid_script = None, True
    return parsed_block.value


def _read_feature_block(
    kind: FenceKind[FeatureBlock], fence: Fence, state: ParsingState, texts: TextParser
) -> Block:
    if fence.nested and not kind.nested:
        message = f"a text of a quiz or lab cannot hold a {fence.kind}"
        state.report(diagnose("fence-info", fence.head, message))
        return fence.code()
    parsed_block = kind.parse(fence, texts)
    state.diagnostics += parsed_block.diagnostics
    return parsed_block.value or fence.code()


_ELEMENTS = re.compile(r"[A-Za-z_][\w-]*(?:/[A-Za-z_][\w-]*)*")


def _read_mjcf(fence: Fence, state: ParsingState) -> Mjcf | CodeBlock:
    """An `mjcf` fence; with wrong keys it cannot be compiled, and is shown as code."""
    parsed_keys = fence.keys(values=("fragment", "error"))
    state.diagnostics += parsed_keys.diagnostics
    keys, fragment = parsed_keys.value, parsed_keys.value.get("fragment")
    if fragment is not None and not _ELEMENTS.fullmatch(fragment.value or ""):
        message = f"`{fragment.value}` is not the name of an element"
        help = 'name the element that it goes into, for example `fragment="worldbody"`'
        state.report(diagnose("fence-key-value", fragment.value_span, message, help=help))
        return fence.code()
    if parsed_keys.diagnostics:
        return fence.code()
    return Mjcf(
        fence.span, fence.body, keys.value("fragment"), keys.value("error"), keys.place("error")
    )
