"""What a fence becomes, by its kind.

Entry point: `fence_block`. Scripts are read in `script`, and other fences by their features. Here
are two kinds of the core:

- `mjcf`: a model or a fragment of one. Keys: `fragment="worldbody"` (where the fragment goes;
  `worldbody/body` names nested elements), `error="…"` (the message it must fail with).
- `bench`: a recorded report on a model. The first word is the name of the model, as in a link
  (`%20` is a space). Keys: `scenario=swing` (the first one without it), `show="plot,table"` (see
  `SHOWN`).
"""

from __future__ import annotations

import re
from urllib.parse import unquote

from coursebuild.core.features import FenceKind
from coursebuild.core.model import Bench, BenchPart, Block, CodeBlock, FeatureBlock, Mjcf, Script
from coursebuild.core.registry import fence_kind
from coursebuild.core.syntax.fence import Fence, kind_doubts
from coursebuild.core.syntax.info import Word, parse_info, read_keys
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.recording import stray_keys
from coursebuild.core.syntax.script import parse_python
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean

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
            session.diagnostics += stray_keys(fence)
            return fence.code()
        case "mjcf":
            mjcf = _parse_mjcf(fence)
            session.diagnostics += mjcf.diagnostics
            return mjcf.value
        case "bench":
            return _bench(fence, session)
        case name if (kind := fence_kind(name)) is not None:
            return _of_feature(kind, fence, session, texts)
        case _:
            session.diagnostics += kind_doubts(fence)
            return fence.code()


def _unclosed(fence: Fence, session: ParsingState) -> CodeBlock:
    """What is inside may be anything, so that nothing is said about it."""
    if session.closes_indented and not fence.info.text:
        session.closes_indented = False
        return fence.code()
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
    parsed = _parse_bench(fence)
    session.diagnostics += parsed.diagnostics
    return _nested(fence, session) if fence.nested else parsed.value


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


_ELEMENTS = re.compile(r"[A-Za-z_][\w-]*(?:/[A-Za-z_][\w-]*)*")


def _parse_mjcf(fence: Fence) -> Parsed[Mjcf | CodeBlock]:
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


SHOWN: tuple[BenchPart, ...] = ("plot", "stable", "orders", "table")
"""What of a report can be shown, in the order in which it is."""
_DEFAULT: tuple[BenchPart, ...] = ("plot", "table")
_PARTS = re.compile(r"[^\s,]+")


def _parse_bench(fence: Fence) -> Parsed[Bench | CodeBlock]:
    """A `bench` fence; one that says in a wrong way what to show is code."""
    info = parse_info(fence.info)
    words = list(info.value.words)
    named = words.pop(0) if words and words[0].value is None else None
    keys = read_keys("bench", words, values=("scenario", "show"))
    diagnostics = [*info.diagnostics, *keys.diagnostics]
    if named is None:
        message = "a bench needs the name of a model"
        help = "write `bench NAME`, with the name of a file in models/, without `.xml`"
        diagnostics.append(diagnose("fence-info", info.value.kind_span, message, help=help))
    shows = _shown(keys.value.get("show"), diagnostics)
    if fence.body.text.strip():
        message = "a bench shows what was recorded, and has no text of its own"
        help = "write the text before or after it"
        place = fence.body.slice(*_stretch(fence.body.text)).span().first_line()
        diagnostics.append(diagnose("bench-text", place, message, help=help))
    if named is None or diagnostics:
        return Parsed(fence.code(), tuple(diagnostics))
    scenario = keys.value.get("scenario")
    bench = Bench(
        fence.span,
        unquote(named.key),
        named.key_span,
        None if scenario is None else scenario.value,
        None if scenario is None else scenario.value_span,
        shows,
    )
    return Parsed(bench)


def _stretch(text: str) -> tuple[int, int]:
    """Where the text without the white space around it begins and ends."""
    return len(text) - len(text.lstrip()), len(text.rstrip())


def _shown(word: Word | None, diagnostics: list[Diagnostic]) -> tuple[BenchPart, ...]:
    """What to show, in the order of `SHOWN`."""
    if word is None or word.value_text is None:
        return _DEFAULT
    wanted: set[str] = set()
    for found in _PARTS.finditer(word.value_text.text):
        name = found[0]
        wanted.add(name)
        if name not in SHOWN:
            span = word.value_text.span(found.start(), found.end())
            message = f"nothing of a report is called `{name}`"
            help = did_you_mean(name, SHOWN)
            diagnostics.append(diagnose("fence-key-value", span, message, help=help))
    if not wanted:
        message, help = "`show` names nothing", "for example `show=plot,table`"
        diagnostics.append(diagnose("fence-key-value", word.value_span, message, help=help))
    return tuple(name for name in SHOWN if name in wanted)
