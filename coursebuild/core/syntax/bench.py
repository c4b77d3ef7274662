"""Bench blocks: a recorded report on a model, shown in a text.

Entry point: `parse_bench`. The first word is the name of the model, as in a link (`%20` is a
space). Keys: `scenario=swing` (the first one without it), `show="plot,table"` (see `SHOWN`).
"""

from __future__ import annotations

import re
from urllib.parse import unquote

from coursebuild.core.model import Bench, BenchPart, CodeBlock
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.info import Word, parse_info, read_keys
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, did_you_mean

SHOWN: tuple[BenchPart, ...] = ("plot", "stable", "orders", "table")
"""What of a report can be shown, in the order in which it is."""
_DEFAULT: tuple[BenchPart, ...] = ("plot", "table")
_PARTS = re.compile(r"[^\s,]+")


def parse_bench(fence: Fence) -> Parsed[Bench | CodeBlock]:
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
