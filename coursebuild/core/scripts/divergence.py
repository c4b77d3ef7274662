"""What to say about a script in which a simulation was lost, though it ended well.

Entry points: `divergence` (what a script did not say of itself), `is_lost`.

A warning of MuJoCo's and a state that is not finite are errors, unless the fence says `diverges`;
bodies deep in each other are a warning, unless it says `deep`. A script that says either and does
not is wrong about itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import assert_never

from coursebuild.core.model.results import Divergence, Outcome, ScriptRun, Sign
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span

_SHOWN = 4
"""Further simulations that are named."""


def is_lost(extraction: Extraction, run: ScriptRun) -> bool:
    """Whether a simulation was lost, without the script's saying so."""
    return not extraction.script.diverges and bool(_lost(run))


def divergence(
    extraction: Extraction, run: ScriptRun, extractions: Iterable[Extraction]
) -> Iterator[Diagnostic]:
    """What is wrong with the simulations of a script that was run."""
    found = () if run.trace is None else run.trace.divergences
    script = extraction.script
    deep = [each for each in found if each.sign is Sign.CONTACT]
    if run.outcome is Outcome.OK and run.trace is not None:
        if script.diverges and not found:
            yield _unlike(extraction, "script-stable", "diverges", "none of its simulations did")
        if script.deep and not deep:
            what = "no bodies lay deep in each other"
            yield _unlike(extraction, "script-shallow", "deep", what)
    if script.diverges or not found:
        return
    by_path = {each.path: each for each in extractions}
    lost = _lost(run)
    if lost:
        yield _diverged(extraction, lost, by_path)
    if deep and not lost and not script.deep:  # what is lost may as well lie anywhere
        yield _deep(extraction, deep, by_path)


def _lost(run: ScriptRun) -> tuple[Divergence, ...]:
    found = () if run.trace is None else run.trace.divergences
    return tuple(each for each in found if each.sign is not Sign.CONTACT)


def _unlike(extraction: Extraction, rule: str, key: str, what: str) -> Diagnostic:
    fence = extraction.script.span.first_line()
    message = f"`{extraction.path}` says `{key}`, and {what}"
    return diagnose(rule, fence, message, help=f"take `{key}` away")


def _diverged(
    extraction: Extraction, lost: Sequence[Divergence], by_path: Mapping[str, Extraction]
) -> Diagnostic:
    said = f"a simulation of `{extraction.path}` diverged"
    help = (
        "try a smaller timestep or another integrator; if it is to diverge, say so by "
        "`diverges` on its fence"
    )
    return _found("script-diverged", extraction, lost, by_path, said, help)


def _deep(
    extraction: Extraction, deep: Sequence[Divergence], by_path: Mapping[str, Extraction]
) -> Diagnostic:
    said = f"bodies of `{extraction.path}` lie deep in each other"
    help = (
        "MuJoCo does not warn of this: try a smaller timestep, stiffer contacts (`solref`), "
        "or look at where they start; if they are to, say so by `deep` on its fence"
    )
    return _found("script-penetration", extraction, deep, by_path, said, help)


def _found(
    rule: str,
    extraction: Extraction,
    found: Sequence[Divergence],
    by_path: Mapping[str, Extraction],
    said: str,
    help: str,
) -> Diagnostic:
    """The first of what was found, where it was found, and some more in notes."""
    place = _place(extraction, found[0], by_path) or extraction.script.span.first_line()
    message = f"{said}: {_told(found[0])}"
    return diagnose(rule, place, message, help=help, notes=_more(extraction, found, by_path))


def _more(
    extraction: Extraction, found: Sequence[Divergence], by_path: Mapping[str, Extraction]
) -> list[Note]:
    further = found[1 : _SHOWN + 1]
    notes = [Note(_told(each), _place(extraction, each, by_path)) for each in further]
    if found[0].path and found[0].path != extraction.path:
        fence = extraction.script.span.first_line()
        notes.insert(0, Note(f"`{extraction.path}` was running", fence))
    left = len(found) - 1 - len(further)
    return [*notes, Note(f"and {left} more like these")] if left > 0 else notes


def _place(
    extraction: Extraction, found: Divergence, by_path: Mapping[str, Extraction]
) -> Span | None:
    """The lesson's line where it was noticed."""
    where = by_path.get(found.path)
    span = None if where is None else where.line_span(found.line)
    if span is None:
        return None
    lead = len(span.text) - len(span.text.lstrip())
    return Span(span.source, span.start + lead, span.end)


def _told(found: Divergence) -> str:
    """What was noticed, in words."""
    of = f" of model `{found.model}`" if found.model else ""
    at = f" at t = {found.time} s" if found.time else ""
    match found.sign:
        case Sign.POSITIONS | Sign.VELOCITIES | Sign.ACCELERATIONS:
            return f"MuJoCo warned of bad {found.sign.value}{of}{at}"
        case Sign.STATE:
            return f"the state{of} is not finite{at}"
        case Sign.CONTACT:
            one, other = (*found.geoms, "", "")[:2]
            return f"{one} and {other}{of} by {found.depth} m{at}"
        case _:
            assert_never(found.sign)
