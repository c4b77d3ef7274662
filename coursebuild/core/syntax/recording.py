"""What scripts print and draw: `output` fences, `Output…:` above a fence or table, figures.

The word of a caption is that of the course's language, or the English one.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal

from coursebuild.core import model
from coursebuild.core.model.blocks import volatile_pattern
from coursebuild.core.model.course import Words
from coursebuild.core.syntax.fence import Fence, FenceKeys, Word
from coursebuild.core.syntax.other_tools import is_known_kind
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.patterns import pattern_mistake, replacements
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

OUTPUT_KIND = "output"
_BODY_KINDS = ("text", OUTPUT_KIND)
_NUMBER = regex(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_VALUES = ("rtol", "atol", "volatile")
_FLAGS = ("exact", "digits", "ellipsis", "volatile")
_MODES = {"rtol": "rtol", "atol": "rtol", **{key: key for key in _FLAGS}}
ILLUSTRATION = "illustration"
"""The flag of a `text` fence that resembles an output and is none."""


def is_caption(inlines: tuple[model.Inline, ...], words: Words) -> bool:
    """Whether a paragraph below a script is a caption: `Output:`, `Output (again):`.

    Instead of what stands in brackets there may be what follows a comma. A sentence that begins
    with the word is none.
    """
    return _match_caption(inlines, words) is not None


def _is_bare(caption: tuple[model.Inline, ...], words: Words) -> bool:
    match = _match_caption(caption, words)
    return match is not None and not match[1]


def _match_caption(caption: tuple[model.Inline, ...], words: Words) -> re.Match[str] | None:
    names = "|".join(map(re.escape, words.output))
    pattern = rf"\s*(?:{names})(\s*\([^()]*\)|,[^:]*)?\s*:\s*"
    return re.fullmatch(pattern, model.plain_text(caption))


def caption_start(text: str, names: tuple[str, ...]) -> int:
    """Where the text of a caption begins, behind one of these words; 0 if there is none."""
    match = re.match(rf"(?:{'|'.join(map(re.escape, names))})[ \u00a0\u202f]?:\s*", text)
    return 0 if match is None else match.end()


def check_code_above(above: Sequence[model.Block], block: model.Block) -> Iterator[Diagnostic]:
    """Report an output below code that nothing runs, unless the code names the output's script.

    Readers would take it for what that code prints.
    """
    before = above[-1] if above else None
    if not isinstance(before, model.CodeBlock | model.PlainCode):
        return
    if not isinstance(block, model.Recording) or block.script is None:
        return
    if posixpath.basename(block.script) not in before.code.text:
        message = "nothing runs the code above this output"
        help = f"put it below `{block.script}`, which it is compared with, or make it a block of "
        help += f"kind `text {ILLUSTRATION}`, without a caption"
        yield diagnose("recording-orphan", block.caption_span, message, help=help)


def record_fence(
    caption: tuple[model.Inline, ...], caption_span: Span, fence: Fence, state: ParsingState
) -> model.Recording | None:
    """The recording with this fence, which needs no caption, as its body; `None` if it is none."""
    if not fence.is_closed or fence.inner is not None:
        return None
    if fence.kind not in _BODY_KINDS:
        if is_known_kind(fence.kind):
            state.diagnostics += check_missing_body(caption, caption_span, state.words)
        else:
            subject = f"a block of kind `{fence.kind}`" if fence.kind else "a block without a kind"
            state.report(diagnose_wrong_body(fence.head, subject))
        return None
    flags = (*_FLAGS, ILLUSTRATION) if ILLUSTRATION in fence.info.text else _FLAGS
    keys = fence.keys(values=_VALUES, flags=flags)
    diagnostics = list(keys.diagnostics)
    mark = keys.value.get(ILLUSTRATION)
    if mark is not None:
        message = "a recorded output is not an illustration"
        help = f"leave `{ILLUSTRATION}` out, or write `text {ILLUSTRATION}` without a caption"
        diagnostics.append(diagnose("recording-keys", mark.span, message, help=help))
    own_words = tuple(word for word in keys.value.words if word is not mark)
    comparison = _read_comparison(FenceKeys(None, own_words), diagnostics)
    state.diagnostics += diagnostics
    return model.Recording(
        caption_span.to(fence.span),
        _own_caption(caption, state.words),
        caption_span,
        fence.body,
        fence.body_span,
        fence.prefix,
        comparison,
        _find_script(caption_span, state),
        state.parts.get(state.script or "", 0),
        readable=not diagnostics,
    )


def record_table(
    caption: tuple[model.Inline, ...], caption_span: Span, table: model.Table, state: ParsingState
) -> model.Recording:
    """The recording with a caption and a table as its body."""
    span, script = caption_span.to(table.span), _find_script(caption_span, state)
    caption = _own_caption(caption, state.words)
    part = state.parts.get(script or "", 0)
    return model.Recording(span, caption, caption_span, table, table.span, "", None, script, part)


def _own_caption(caption: tuple[model.Inline, ...], words: Words) -> tuple[model.Inline, ...]:
    is_plain = all(isinstance(inline, model.Text) for inline in caption)
    return () if is_plain and _is_bare(caption, words) else caption


def check_missing_body(
    caption: tuple[model.Inline, ...], span: Span, words: Words, following: Span | None = None
) -> list[Diagnostic]:
    """Report a caption without a body, if it can be nothing but a caption."""
    if not _is_bare(caption, words):
        return []
    message = "no recorded output follows this line"
    help = "put a fence that begins with ```` ```output ````, or a table, directly below it"
    notes = [] if following is None else [Note("this follows it", following.first_line())]
    return [diagnose("recording-body", span, message, help=help, notes=notes)]


def diagnose_wrong_body(span: Span, subject: str) -> Diagnostic:
    """The diagnostic of a caption above something that is no body, called `subject`."""
    message = f"the recorded output is {subject}, not of kind `output` or `text`"
    help = (
        "write the output in a fence that begins with ```` ```output ````, "
        "or end the paragraph without a colon"
    )
    return diagnose("recording-body", span, message, help=help)


def _find_script(caption_span: Span, state: ParsingState) -> str | None:
    if state.script is None and not state.has_invalid_script:
        message = "there is no script above this recorded output"
        help = "it records what the nearest ```` ```python file=examples/….py ```` above it prints"
        state.report(diagnose("recording-orphan", caption_span, message, help=help))
    return state.script


def _read_comparison(keys: FenceKeys, diagnostics: list[Diagnostic]) -> model.Comparison | None:
    """The comparison that the keys of a `text` fence ask for; `None` without keys."""
    rtol = _read_tolerance(keys.get("rtol"), diagnostics)
    atol = _read_tolerance(keys.get("atol"), diagnostics)
    words = [w for w in keys.words if w.key != "volatile" or w.value is None]
    for first, second in ((a, b) for i, b in enumerate(words) for a in words[:i]):
        modes = {_MODES[first.key], _MODES[second.key]}
        if len(modes) == 2 and ("ellipsis" not in modes or "volatile" in modes):
            message = f"`{second.key}` contradicts `{first.key}`"
            notes = [Note(f"`{first.key}` is given here", first.key_span)]
            diagnostic = diagnose("recording-keys", second.key_span, message, notes=notes)
            diagnostics.append(diagnostic)
            break
    ellipsis = keys.get("ellipsis") is not None
    volatile, word = "", keys.get("volatile")
    if word is not None and word.value_text is not None:
        pattern = word.value_text.text
        mistake = pattern_mistake(pattern) or pattern_mistake(volatile_pattern(pattern))
        if mistake is not None or replacements(pattern, "", ""):
            message = "the pattern matches where there is nothing"
            if mistake is not None:
                message = f"the pattern does not compile: {mistake[0]}"
            diagnostics.append(diagnose("fence-key-value", word.value_span, message))
        else:
            volatile = pattern
    if keys.get("volatile") and not volatile:
        return model.Comparison(model.Mode.VOLATILE)
    mode = model.Mode.DIGITS if keys.get("digits") else model.Mode.EXACT
    if rtol is not None or atol is not None:
        mode = model.Mode.TOLERANCE
    if not keys.words:
        return None
    return model.Comparison(mode, rtol or Decimal(0), atol or Decimal(0), ellipsis, volatile)


def check_stray_keys(fence: Fence, state: ParsingState) -> None:
    """Report keys on a `text` fence that records no output."""
    keys = fence.keys(values=_VALUES, flags=(*_FLAGS, ILLUSTRATION))
    state.diagnostics += keys.diagnostics
    words = [word for word in keys.value.words if word.key != ILLUSTRATION]
    if words:
        span = words[0].span.to(words[-1].span)
        message = "this block is not a recorded output, so it is not compared with anything"
        help = "an output is of kind `output`"
        state.report(diagnose("recording-keys", span, message, help=help))


def _read_tolerance(word: Word | None, diagnostics: list[Diagnostic]) -> Decimal | None:
    if word is None or word.value is None:
        return None
    value = Decimal(word.value) if _NUMBER.fullmatch(word.value) else Decimal(-1)
    if value >= 0 and (word.key == "atol" or value < 1):
        return value
    help = "`atol` is a number from 0 on, `rtol` a share of the recorded one from 0 to less than 1"
    message = f"`{word.value}` is no tolerance"
    diagnostics.append(diagnose("fence-key-value", word.value_span, message, help=help))
    return None


def read_figure(
    children: tuple[model.Inline, ...], span: Span, state: ParsingState
) -> tuple[tuple[model.Inline, ...], bool]:
    """The inlines of a paragraph that begins with `Figure:`, and whether it shows an image.

    Then they are without that word. Without an image it shows the first figure of the scripts
    above that nothing has shown yet, with its text as the alternative.
    """
    figure_names = state.figures
    image = next((child for child in children if isinstance(child, model.Image)), None)
    first = children[0] if children else None
    if isinstance(first, model.Text) and (image is not None or figure_names):
        start = caption_start(first.text, state.words.figure)
        place = Span(
            first.span.source, min(first.span.start + start, first.span.end), first.span.end
        )
        rest = (model.Text(place, first.text[start:]),) if first.text[start:] else ()
        children = (*rest, *children[1:])
    if image is None and figure_names:
        text = " ".join(model.plain_text(children).split())
        image = model.Image(span, figure_names[0], text, "", span)
        children = (*children, image)
    name = "" if image is None else posixpath.basename(image.url)
    if name in figure_names:
        figure_names.remove(name)
    return children, image is not None
