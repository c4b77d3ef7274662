"""What a fence becomes, by its kind.

Entry point: `fence_block`.
"""

from __future__ import annotations

from coursebuild.core.features import FenceKind, fence_kind
from coursebuild.core.model import Block, CodeBlock, FeatureBlock, Script
from coursebuild.core.syntax.fence import Fence, missing_feature, near_kind
from coursebuild.core.syntax.info import parse_info, read_keys
from coursebuild.core.syntax.mjcf import parse_mjcf
from coursebuild.core.syntax.recording import stray_keys
from coursebuild.core.syntax.script import parse_python
from coursebuild.core.syntax.session import ParsingState
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Note, diagnose

_HEAD_RULES = frozenset(
    {"fence-info", "fence-key-repeated", "fence-key-unknown", "fence-key-value", "script-path"}
)
"""Mistakes that may have kept a block from being a script."""


def fence_block(fence: Fence, session: ParsingState, texts: TextParser) -> Block:
    """The block of a fence that records no output."""
    if not fence.closed or fence.inner is not None:
        return _unclosed(fence, session)
    match fence.kind:
        case "python":
            return _python(fence, session)
        case "text":
            for wrong in stray_keys(fence):
                session.report(wrong)
            return fence.code()
        case "mjcf":
            mjcf = parse_mjcf(fence)
            session.diagnostics += mjcf.diagnostics
            return mjcf.value
        case "bench":
            return _bench(fence, session)
        case "lab":
            return _lab(fence, session, texts)
        case name if (kind := fence_kind(name)) is not None:
            return _of_feature(kind, fence, session, texts)
        case _:
            missing = missing_feature(fence)
            if missing is not None:
                session.report(missing)
            near = near_kind(fence)
            if near is not None:
                session.report(near)
            return fence.code()


def _unclosed(fence: Fence, session: ParsingState) -> CodeBlock:
    """What is inside may be anything, so that nothing is said about it."""
    marks = fence.head.text[: len(fence.head.text) - len(fence.head.text.lstrip("`~"))]
    name = "backticks" if marks[0] == "`" else "tildes"
    help = f"close it with a line of {len(marks)} {name} in the same quote or list item"
    message, notes = "this code fence is never closed", []
    if fence.inner is not None:
        message = "this code fence is not closed before another one begins"
        notes = [Note("this line is read as text of the fence above it", fence.inner)]
    session.report(diagnose("fence-unclosed", fence.head, message, help=help, notes=notes))
    if fence.kind == "python" or fence.inner is not None:
        session.script, session.script_wrong = None, True
    return fence.code()


def _python(fence: Fence, session: ParsingState) -> Block:
    parsed = parse_python(fence)
    session.diagnostics += parsed.diagnostics
    if isinstance(parsed.value, Script):
        session.script, session.script_wrong = parsed.value.path, False
    elif not fence.nested and any(d.rule in _HEAD_RULES for d in parsed.diagnostics):
        session.script, session.script_wrong = None, True
    return parsed.value


def _bench(fence: Fence, session: ParsingState) -> Block:
    from coursebuild.core.syntax.bench import parse_bench

    parsed = parse_bench(fence)
    session.diagnostics += parsed.diagnostics
    return _nested(fence, session) if fence.nested else parsed.value


def _lab(fence: Fence, session: ParsingState, texts: TextParser) -> Block:
    info = parse_info(fence.info)
    session.diagnostics += info.diagnostics
    words = list(info.value.words)
    kind, kind_span = "simlab", info.value.kind_span
    if words and words[0].value is None:
        kind, kind_span = words[0].key, words.pop(0).key_span
    session.diagnostics += read_keys(fence.kind, words).diagnostics
    if fence.nested:
        return _nested(fence, session)
    from coursebuild.core.syntax.lab import parse_lab

    lab = parse_lab(fence.span, kind, kind_span, fence.body, texts)
    session.diagnostics += lab.diagnostics
    return lab.value or fence.code()


def _of_feature(
    kind: FenceKind[FeatureBlock], fence: Fence, session: ParsingState, texts: TextParser
) -> Block:
    if fence.nested and not kind.nested:
        return _nested(fence, session)
    parsed = kind.parse(fence, texts)
    session.diagnostics += parsed.diagnostics
    return parsed.value or fence.code()


def _nested(fence: Fence, session: ParsingState) -> CodeBlock:
    message = f"a text of a quiz or lab cannot hold a {fence.kind}"
    session.report(diagnose("fence-info", fence.head, message))
    return fence.code()
