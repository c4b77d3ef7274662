"""Numbers in prose that must be what a script printed: `` `+6.6 %`{out} ``.

1. A binding depends on the nearest recorded output above it, or on the script that `{out=…}` names:
   on its recorded outputs anywhere in the course, or else on what it printed in this run.
2. The numbers of a binding must be numbers of one printed line, one after the other, each rounded
   to the digits shown: within half a unit of the last place shown. Integers must be equal.
3. Its address decides where these are looked for: see `bound_places`. Drift of a recorded output
   is reported by itself, with the bindings that depend on it.
4. A binding without a number must stand in the output as text.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Context, Decimal
from itertools import chain, islice

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.model.results import Change, DriftKind, Outcome, Verdict
from coursebuild.core.scripts.bound_numbers import (
    BoundText,
    shows,
    text_places,
)
from coursebuild.core.scripts.bound_places import (
    BoundNumber,
    bound_values,
    place_note,
    reworded_addresses,
)
from coursebuild.core.scripts.diff import limit_notes
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.scripts.lines import masked, plain_text
from coursebuild.core.scripts.printed_outputs import PrintedOutputs, recording_key
from coursebuild.core.scripts.printed_text import PrintedPlace, PrintedText
from coursebuild.core.scripts.table_cells import row_values
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Fix, diagnose, did_you_mean
from coursebuild.core.text.numbers import Number, difference
from coursebuild.core.text.quantities import with_unit

_SILENT_OUTCOMES = (
    Outcome.FAILED,
    Outcome.TIMEOUT,
    Outcome.KILLED,
    Outcome.OUTPUT_LIMIT,
    Outcome.ENCODING,
    Outcome.UNRECORDED,
)
"""Those that are reported by themselves, so that no more is said of numbers bound to them."""


class DependentBinding(Struct, frozen=True):
    """A binding, and the change of a recorded value that it depends on."""

    binding: model.NumberBinding
    change: Change


def check_bindings(
    document: model.Document, outputs: PrintedOutputs, addresses: Addresses | None = None
) -> tuple[Diagnostic, ...]:
    """What is wrong with the bindings of a document.

    Bindings that depend on a failed script get none: the failure itself is reported. `addresses`
    holds those where bindings held before, and gets those where they hold now.
    """
    addresses = {} if addresses is None else addresses
    diagnostics: list[Diagnostic] = []
    for binding, value in bound_values(document, outputs):
        diagnostic, places = _check(BoundNumber(binding, outputs, addresses.get(value, ())))
        if diagnostic is not None:
            diagnostics.append(diagnostic)
        at = tuple(address for place in places if (address := place.address) is not None)
        if at and len(at) == len(places):
            addresses[value] = tuple(dict.fromkeys(at))
    for verdict in outputs.of_document(document):
        rows = row_values(document, verdict.recording, verdict.comparison.filters)
        places_of_rows = zip(rows, verdict.row_addresses, strict=False)
        addresses |= {value: at for value, at in places_of_rows if at}
    return tuple(diagnostics)


def _check(bound: BoundNumber) -> tuple[Diagnostic | None, Sequence[PrintedPlace]]:
    """What is wrong with a binding, and where it holds: nowhere if it is unchecked, or a text."""
    binding, run, verdicts = bound.binding, bound.run, bound.verdicts
    if bound.path not in bound.outputs.scripts:
        return _orphan_diagnostic(bound), ()
    is_silent = not any(run.output_of(v.recording.part).strip() for v in verdicts) if run else False
    if run is not None and (
        run.outcome in _SILENT_OUTCOMES or (verdicts and bound.ran_well and is_silent)
    ):
        return None, ()
    if not verdicts and not bound.ran_well:
        is_run = run is None or run.outcome is not Outcome.NORUN
        return None if is_run else _orphan_diagnostic(bound), ()
    if not bound.text.numbers:
        lines = (line for texts in bound.groups for text in texts for line in text.lines)
        if next(text_places(bound.text.before, lines), None) is not None:
            return None, ()
    places = bound.places() if bound.text.numbers else []
    if places:
        mismatch = _wrong_unit(bound, bound.text, places[:1])
        if mismatch is not None:
            return mismatch, ()
        if len({place.quantity(binding.words) for place in places} - {None}) <= 1:
            return None, places
        message = f"`{bound.path}` printed `{binding.text}` at {len(places)} places"
        notes = limit_notes([place_note(binding, p, places) for p in places], _MAX_NOTES)
        place, help = binding.text_span, _choose(binding)
        return diagnose("output-ambiguous", place, message, help=help, notes=notes), places
    varying = [v.recording for v in verdicts if v not in bound.steady or v.comparison.volatile]
    is_unsteady = bool(bound.text.numbers) and not bound.text.is_in(bound.recorded)
    unfiltered = map(PrintedText.of_recording, varying)
    if varying and (not bound.steady or (is_unsteady and bound.text.is_in(unfiltered))):
        message = f"`{binding.text}` is bound to an output that differs from run to run"
        help = "remove `{out}`, or narrow `volatile` so that this number is compared"
        return diagnose("binding-volatile", binding.text_span, message, help=help), ()
    if not bound.ran_well and any(isinstance(v.recording.body, model.Table) for v in verdicts):
        return None, ()  # it may stand in what a table leaves out
    return _mismatch(bound), ()


def _choose(binding: model.NumberBinding) -> str:
    example = binding.mark(words="tau")
    return f"say which: write the words that are printed right before it, as in `{example}`"


_MAX_NOTES = 4


def _wrong_unit(
    bound: BoundNumber, text: BoundText, places: Iterable[PrintedPlace]
) -> Diagnostic | None:
    """The diagnostic of a number whose unit is another than is printed with it at any place."""
    mismatch = text.wrong_unit(places, bound.following)
    if mismatch is None:
        return None
    number, printed_text, unit_text = mismatch
    quantity = with_unit(number.text, printed_text)
    message = f"`{bound.path}` printed `{quantity}`, and the unit here is `{unit_text}`"
    help = "write the unit that is printed, or let the script convert the number; where it is not"
    escape = 'write `{given="…"}` in place of `{out}`'
    if bound.binding.is_in_formula:
        escape = r"write the number without `\out`"
    help += f" meant, {escape}"
    return diagnose("binding-mismatch", bound.binding.text_span, message, help=help)


def unprinted_unit(bound: BoundNumber) -> str:
    """The unit of a bound number that is printed with none; empty if there is no such.

    A unit that its label or heading names, whatever else they name, is taken for printed.
    """
    is_known = bound.path in bound.outputs.scripts and bound.text.numbers
    shown_units = bound.text.units(bound.following) if is_known else []
    places = [*bound.places()] if any(shown_units) else []
    for at, unit in enumerate(shown_units):
        if unit and places and not any(place.units[at] or place.names(unit) for place in places):
            return unit.text
    return ""


def _orphan_diagnostic(bound: BoundNumber) -> Diagnostic:
    """A binding that has no output: none above it, no such script, or one that is not run."""
    binding, path, scripts = bound.binding, bound.path, bound.outputs.scripts
    if not path:
        target = ", but there is no recorded output above it"
        example = binding.mark("examples/…")
        help = f"write it below the output, or name the script: `{example}`"
    elif path in scripts:
        target = f" to `{path}`, which has no recorded output and is not run"
        help = "record its output below it"
    else:
        target = f" to `{path}`, which is not a script of the course"
        help = did_you_mean(path, scripts)
        if isinstance(help, Fix):
            help = help.at(binding.span)
    message = f"`{binding.text}` is bound{target}"
    return diagnose("binding-orphan", binding.text_span, message, help=help)


def dependent_bindings(
    verdict: Verdict,
    documents: Iterable[model.Document],
    outputs: PrintedOutputs,
    addresses: Addresses,
) -> tuple[DependentBinding, ...]:
    """The bindings of the course, in order, that depend on a changed value of a recording."""
    changes = [c for c in verdict.changes if c.kind is not DriftKind.EXTRA]
    key, output = recording_key(verdict.recording), outputs.text(verdict)
    dependents: list[DependentBinding] = []
    for binding, value in chain(*(bound_values(document, outputs) for document in documents)):
        if all(recording_key(v.recording) != key for v in outputs.of_binding(binding)):
            continue
        bound = BoundNumber(binding, outputs, addresses.get(value, ()))
        places = text_places(bound.text.before, output.lines)
        if bound.text.numbers:
            shown_places = filter(bound.text.shows, bound.look_up([output]))
            places = ((p.line, n.start, n.end) for p in shown_places for n in p.numbers)
        spans = (line.locate(a, b) for line, a, b in places if line.locate is not None)
        overlaps = (
            DependentBinding(binding, change)
            for span in spans
            for change in changes
            if span.start < change.span.end and change.span.start < span.end
        )
        dependents += islice(overlaps, 1)
    return tuple(dependents)


def update_outputs(
    verdicts: Iterable[Verdict],
    documents: Iterable[model.Document],
    outputs: PrintedOutputs,
    addresses: Addresses,
) -> tuple[list[Edit], list[Diagnostic]]:
    """The edits by which recorded outputs, and numbers bound to them, become what runs printed.

    Also, why outputs cannot be written. `verdicts` are on the outputs, whose scripts ran well, and
    `documents` have the bound numbers. These become what stands at their addresses; where one is
    gone, or several of one number do not agree, nothing is written. For `addresses` see
    `check_bindings`.
    """
    edits: list[Edit] = []
    refusals: list[Diagnostic] = []
    is_written: dict[tuple[str, int], bool] = {}
    documents, verdicts = [*documents], [*verdicts]
    for verdict in verdicts:
        recording = verdict.recording
        printed = outputs.runs[recording.script or ""].output_of(recording.part)
        change = update_body(recording, verdict.comparison, printed, verdict.row_addresses)
        is_written[recording_key(recording)] = not isinstance(change, Diagnostic)
        if isinstance(change, Diagnostic):
            refusals.append(change)
        elif change is not None:
            edits.append(change)
    for document in documents:
        check_bindings(document, outputs, addresses)
    addresses_now = addresses | reworded_addresses(addresses, verdicts, outputs)
    for document in documents:
        for binding, value in bound_values(document, outputs):
            bound = BoundNumber(binding, outputs, addresses_now.get(value, ()))
            states = [is_written.get(recording_key(v.recording)) for v in bound.steady]
            is_open = False in states or (bound.verdicts and not bound.steady)
            is_known = bool(bound.addresses or binding.words)
            if not bound.ran_well or is_open or not bound.text.numbers or not is_known:
                continue
            texts = [
                outputs.updated_text(verdict) if is_new else outputs.text(verdict)
                for verdict, is_new in zip(bound.steady, states, strict=True)
            ]
            texts += bound.printed
            places = bound.look_up(texts)
            if bound.contradicts_words(places, texts) or bound.contradicts_itself(places, texts):
                continue
            if bound.text.wrong_unit(places[:1], bound.following) is not None:
                continue  # `0.5 s`, where `12 ms` is printed
            rewritten = {bound.text.rewrite(place) for place in places}
            is_shown = all(map(bound.text.shows, places))
            if not is_shown and len(rewritten) == 1 and (new := rewritten.pop()):
                edits.append(Edit(binding.text_span, new))
    return edits, refusals


_QUOTIENT = Context(prec=34)


def _mismatch(bound: BoundNumber) -> Diagnostic:
    """The diagnostic of a binding that none of its outputs bears out."""
    binding, path, bound_text = bound.binding, bound.path, bound.text
    outputs = bound.groups[-1]
    bare, stray, label = bound_text.bare, bound_text.stray, ""
    message = f"`{binding.text}` is not what `{path}` printed, rounded to the digits shown"
    if not bound_text.numbers:
        message = f"`{binding.text}` is not in the output of `{path}`"
        help = "write it as it is printed, or remove `{out}`"
    elif bound.addresses or binding.words:
        return _address_mismatch(bound, message)
    elif stray and not stray[-1].isdigit() and bare.is_in(outputs):  # a digit is no sign to remove
        message = f"`{path}` printed no `{stray}` beside the number in `{binding.text}`"
        help = Fix(f"remove the `{stray}`", "", stray)
    elif mismatch := _wrong_unit(bound, bare, bare.shown_places(outputs)):
        return mismatch
    else:
        label, help = _nearest(bound_text, outputs), ""
    return diagnose("binding-mismatch", binding.text_span, message, label=label, help=help)


def _address_mismatch(bound: BoundNumber, message: str) -> Diagnostic:
    """The diagnostic of a binding at whose address stands another number now, or none."""
    binding, text, label, help = bound.binding, bound.text, "", ""
    noted_places = rivals = places_now = bound.current_places
    places_now.sort(key=lambda place: _distance(text.numbers, place.numbers))
    if len({text.rewrite(place) for place in places_now}) > 1:
        message = f"the places that showed `{binding.text}` have different numbers now"
        if binding.words:
            message = f"`{bound.path}` printed `{binding.words}` before {len(places_now)} numbers"
        help = _choose(binding)
    elif places_now and (mismatch := _wrong_unit(bound, text, places_now[:1])):
        return mismatch
    elif places_now:
        place, better = places_now[0], text.rewrite(places_now[0])
        better_text = BoundText.of(better, bool(text.comma), may_join=True)
        if better and not better_text.is_in([place.output]):
            better = ""  # other numbers have its words or unit
        are = "are" if len(text.numbers) > 1 else "is"
        label = f"{place.text} {are} printed there now, in `{plain_text(place.line.text)}`"
        help = Fix(f"write `{better}`", better, safe=True) if better else ""
        noted_places = [] if bound.addresses else text.bare.shown_places([place.output])
    elif binding.words:
        message = f"`{bound.path}` printed no number right after `{binding.words}`"
        of_script = replace(binding, script=bound.path)
        noted_places = rivals = BoundNumber(of_script, bound.outputs).current_places
        if rivals:
            message = f"the output above has no number right after `{binding.words}`"
            message += f", another of `{bound.path}` has"
            binding = of_script
        else:  # a number among its words may be another now
            attempts = (replace(binding, words=words) for words in ("", masked(binding.words)))
            choices = (BoundNumber(attempt, bound.outputs).current_places for attempt in attempts)
            noted_places = rivals = next(filter(None, choices), [])
            noted_places.sort(key=lambda place: _distance(text.numbers, place.numbers))
    else:
        count, lines = len(text.numbers), bound.groups[-1]
        lost = [a for a in bound.addresses if all(o.find(a, count) is None for o in lines)]
        line_text = (*lost, *bound.addresses)[0].description
        message = f"the line that showed `{binding.text}` is no longer printed: {line_text}"
        noted_places = rivals = replace(bound, addresses=()).places()
    if not (places_now or (binding.words and noted_places)):
        example = binding.mark(words="tau")
        help = f"bind it anew: choose the words before it, as in `{example}`"
    notes = [place_note(binding, place, rivals) for place in noted_places[:_MAX_NOTES]]
    return diagnose(
        "binding-mismatch", binding.text_span, message, label=label, help=help, notes=notes
    )


def _nearest(bound_text: BoundText, outputs: Sequence[PrintedText]) -> str:
    """The printed numbers nearest to those of a binding, in words."""
    places = bound_text.places(outputs)
    if not places:
        if len(bound_text.numbers) > 1 and any(o for output in outputs for o in output.places(1)):
            return f"no printed line has {len(bound_text.numbers)} numbers one after the other"
        return "no number was printed"
    nearest = min(places, key=lambda place: _distance(bound_text.numbers, place.numbers))
    several = len(bound_text.numbers) > 1
    return f"the nearest printed value{'s are' if several else ' is'} {nearest.text}"


def _distance(
    bound_numbers: Sequence[Number], printed: Sequence[Number]
) -> tuple[Decimal, Decimal]:
    """The distance of printed numbers from bound ones: relative to their sizes, and absolute."""
    relative = absolute = Decimal()
    for s, p in zip(bound_numbers, printed, strict=True):
        if shows(s, p):
            continue
        if not (s.is_finite and p.is_finite):
            return Decimal("Infinity"), absolute
        shown_size, printed_size = s.value.copy_abs(), p.value.copy_abs()
        if size := max(shown_size, printed_size):  # `00` is 0 and not shown as it
            relative += _QUOTIENT.divide(difference(shown_size, printed_size), size)
        absolute += difference(s.value, p.value)
    return relative, absolute
