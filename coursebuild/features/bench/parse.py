"""Parses `bench` fences.

Entry point: `parse_bench`. The first word is the name of the model, as in a link (`%20` is a
space). Keys: `scenario=swing` (default: the first), `show="plot,table"` (see `PARTS`), or
`sweep=softness`.
"""

from __future__ import annotations

from urllib.parse import unquote

from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.info import Word, kind_of
from coursebuild.core.syntax.spans import trim
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, did_you_mean
from coursebuild.features.bench.model import PARTS, Bench, BenchPart

_DEFAULT: tuple[BenchPart, ...] = ("plot", "table")


def parse_bench(fence: Fence, _: TextParser) -> Parsed[Bench | None]:
    """Parse a `bench` fence; `None` if it has mistakes."""
    parsed_keys = fence.keys(values=("scenario", "sweep", "show"), has_name=True)
    keys, diagnostics = parsed_keys.value, list(parsed_keys.diagnostics)
    if keys.name is None:
        message = "a bench needs the name of a model"
        help = "write `bench NAME`, with the name of a file in models/, without `.xml`"
        diagnostics.append(diagnose("fence-info", kind_of(fence.info).span(), message, help=help))
    show = keys.get("show")
    shows = _DEFAULT if show is None else _parse_parts(show, diagnostics)
    body = trim(fence.body, " \t\n")
    if body.text:
        message = "a `bench` block shows a recorded report and takes no text"
        help = "write the text before or after it"
        diagnostics.append(diagnose("bench-text", body.span().first_line(), message, help=help))
    if keys.name is None or diagnostics:
        return Parsed(None, tuple(diagnostics))
    model, place = unquote(keys.name.key), keys.name.key_span
    scenario, scenario_place = keys.value("scenario"), keys.place("scenario")
    sweep, sweep_place = keys.value("sweep"), keys.place("sweep")
    bench = Bench(fence.span, model, place, scenario, scenario_place, sweep, sweep_place, shows)
    return Parsed(bench)


def _parse_parts(show: Word, diagnostics: list[Diagnostic]) -> tuple[BenchPart, ...]:
    """Read which parts to show, in the order of `PARTS`."""
    parts = {part.text: part for part in reversed(show.parts()) if part.text}
    for name, part in parts.items():
        if name not in PARTS:
            message, help = f"nothing of a report is called `{name}`", did_you_mean(name, PARTS)
            diagnostics.append(diagnose("fence-key-value", part.span(), message, help=help))
    if not parts:
        message, help = "`show` names nothing", "for example `show=plot,table`"
        diagnostics.append(diagnose("fence-key-value", show.value_span, message, help=help))
    return tuple(name for name in PARTS if name in parts)
