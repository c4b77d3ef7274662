"""A recorded output that differs from this run, told to its author.

Entry point: `drift_diagnostic`.

The first differing place is pointed at; a note names each further one (up to 20, the rest by
count), then the classes, the diff, and every bound number in the prose that leans on a value that
changed.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.bindings import Leaning
from coursebuild.core.scripts.bound_numbers import Shown, shows
from coursebuild.core.scripts.diff import shortened
from coursebuild.core.scripts.numbers import scan
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose

_NAMED = 20
_WIDTH = 60


def drift_diagnostic(verdict: Verdict, owner: str, leaning: Sequence[Leaning] = ()) -> Diagnostic:
    """The diagnostic of a verdict of drift; `owner` is the id of the lesson or page."""
    first, *others = sorted(verdict.changes, key=lambda change: change.span.start)
    notes = [Note(_further(change), change.span) for change in others[:_NAMED]]
    if len(others) > _NAMED:
        more = len(others) - _NAMED
        notes.append(Note(f"and {more} more {'difference' if more == 1 else 'differences'}"))
    notes.append(Note(classes(verdict.changes)))
    if verdict.diff:
        notes.append(Note(f"recorded against this run:\n{verdict.diff}"))
    notes += (Note(_leans(leans), leans.binding.text_span) for leans in leaning)
    return diagnose(
        "output-drift",
        first.span,
        "recorded output differs from this run",
        label=_label(first),
        help=f"if the change is intended, run `coursebuild update {owner}`",
        notes=notes,
    )


def classes(changes: Sequence[Change]) -> str:
    """How many differences of each class: `rounding: 2, numeric: 1`; lines are counted each."""
    counts = dict.fromkeys(DriftKind, 0)
    for change in changes:
        text = change.recorded if change.kind is DriftKind.MISSING else change.ran
        lines = change.kind in (DriftKind.MISSING, DriftKind.EXTRA)
        counts[change.kind] += text.count("\n") + 1 if lines else 1
    return ", ".join(f"{kind.value}: {count}" for kind, count in counts.items() if count)


def _label(change: Change) -> str:
    """What is written beside the place of a change."""
    match change.kind:
        case DriftKind.ROUNDING | DriftKind.NUMERIC:
            return f"this run printed {_quoted_number(change.ran)}{_closeness(change)}"
        case DriftKind.TEXT:
            return _text_label(change)
        case DriftKind.MISSING:
            count = change.recorded.count("\n") + 1
            what = "this line" if count == 1 else f"these {count} lines"
            return f"this run did not print {what}"
        case DriftKind.EXTRA:
            first, *rest = change.ran.split("\n")
            more = f" and {len(rest)} more line{'s' if len(rest) > 1 else ''}" if rest else ""
            return f"this run printed {_quoted(first)}{more} here"


def _text_label(change: Change) -> str:
    if not (change.recorded.strip() or change.ran.strip()):
        return "this run printed white space of another width here"
    same_value = _same_value(change)
    if not change.ran.strip():
        return "this run printed nothing here"
    what = f"this run printed {_quoted_number(change.ran) if same_value else _quoted(change.ran)}"
    return f"{what} (the same value, written in another way)" if same_value else what


def _same_value(change: Change) -> bool:
    recorded, ran = scan(change.recorded), scan(change.ran)
    if len(recorded) != 1 or len(ran) != 1:
        return False
    whole = recorded[0].text == change.recorded and ran[0].text == change.ran
    return whole and recorded[0].value == ran[0].value


def _closeness(change: Change) -> str:
    if change.relative_error is None:
        return ""
    if change.digits is None:
        return f" (relative error {change.relative_error:.1e})"
    agree = {0: "no digit agrees", 1: "1 digit agrees"}.get(
        change.digits, f"{change.digits} digits agree"
    )
    return f" (relative error {change.relative_error:.1e}, {agree})"


def _further(change: Change) -> str:
    """A difference after the first, where no text stands beside its place."""
    if change.kind is DriftKind.EXTRA:
        return _label(change)
    if change.kind is DriftKind.MISSING:
        first = change.recorded.split("\n")[0]
        return f"recorded {_quoted(first)}; {_label(change)}"
    if not change.recorded.strip():
        return _label(change)
    numeric = change.kind is not DriftKind.TEXT or _same_value(change)
    recorded = _quoted_number(change.recorded) if numeric else _quoted(change.recorded)
    return f"recorded {recorded}; {_label(change)}"


def _quoted(text: str) -> str:
    return f"`{shortened(text.strip(), _WIDTH)}`"


def _quoted_number(text: str) -> str:
    return shortened(text, _WIDTH)


def _leans(leans: Leaning) -> str:
    """What a change means for a bound number of the prose."""
    change = leans.change
    lead = f"`{leans.binding.text}` leans on "
    recorded, ran = scan(change.recorded), scan(change.ran)
    if len(recorded) != 1 or len(ran) != 1 or change.kind is DriftKind.MISSING:
        return lead + "a line that changed"
    shown = [n for n in Shown.of(leans.binding.text).numbers if shows(n, recorded[0])]
    holds = ", and still holds" if any(shows(n, ran[0]) for n in shown) else ""
    return f"{lead}{recorded[0].text}, which this run printed as {ran[0].text}{holds}"
