"""`coursebuild import --prove`: run what was imported, and write what running shows.

Each script runs once as a chain of cells: after one that fails, the next goes on. A cell that
cannot run is then shown, with the reason, and so are those below it that need what it would
define; all others remain parts of the script. Where only a module is missing, its import alone is
taken out of the cell. What is left runs a second time: that bears out what is recorded, and shows
what varies from run to run. What takes long is recorded from one run.

A script gets the keys that it needs: `requires`, `timeout`, `record=once`, `writes`, `diverges`,
`deep`; an output `volatile`.
"""

from __future__ import annotations

import math
import posixpath
import re
from collections import defaultdict
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from textwrap import shorten

from msgspec.structs import replace

from coursebuild.api import (
    Course,
    Edit,
    Excerpt,
    Options,
    Outcome,
    Recording,
    ScriptRun,
    Source,
    Span,
    Store,
    marks,
    model,
    regex,
)
from coursebuild.core.files.examples import write_examples
from coursebuild.core.model.results import Change, EffectKind, Sign
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.scripts.extract import Extraction, jobs
from coursebuild.core.values import fingerprint
from coursebuild.features.importer.chain import Chain, name_package
from coursebuild.features.importer.commands.findings import Findings, Rank
from coursebuild.features.importer.commands.joined_cells import (
    end_before_failure,
    find_cells,
    mark_cells,
)
from coursebuild.pipeline.load import load
from coursebuild.pipeline.recordings import record_runs, write_figures
from coursebuild.pipeline.scripts import extract_scripts, recorded_outputs
from coursebuild.pipeline.scripts import run as run_scripts
from coursebuild.report.values import plural

NOTEBOOK_OUTPUT = "notebook-output"
"""The kind of entries that say: this is recorded in a notebook, and may be replaced."""
_LONG_TIMEOUT = 900.0
"""Seconds that a script may take here, if it does not say itself."""
_TIME_FACTOR = 3.0
"""A script's new time limit, as a multiple of the time it took here."""


def prove(options: Options, most_seconds: float) -> Findings:
    """Run the scripts of an imported course, and write what that shows into its files.

    What takes more than `most_seconds` is recorded once. Scripts whose runs are remembered do not
    run again.
    """
    course, findings = _load(options), Findings(options)
    if course is None:
        return findings
    scripts = extract_scripts(course, options).runnable
    first_runs = _run_first(course, scripts, options)
    edits = defaultdict[Source, list[Edit]](list)
    changed_paths = set[str]()
    for extraction in scripts:
        script, script_run = extraction.script, first_runs[extraction.path]
        keys = [*_missing_keys(script, script_run, most_seconds)]
        if find_cells(script) and script_run.outcome in (Outcome.OK, Outcome.FAILED):
            changed_paths.add(script.path)
            if script_run.outcome is Outcome.FAILED:
                edits[script.span.source] += end_before_failure(script, script_run)
                message = f"{script.path} ends before the first cell that cannot run"
                findings.add(Rank.FAILED, message)
            else:
                edits[script.span.source] += _add_keys(script, keys, findings)
            continue
        cells = _settle(script, script_run, course, keys, options, findings, edits)
        if cells.is_changed:
            changed_paths.add(script.path)
        for module in cells.modules:
            findings.add(Rank.MISSING, f"{script.path}: {name_package(module, options)}")
    findings.write(edits)
    _run_again(first_runs, changed_paths, options, findings)
    return findings


def _run_first(
    course: Course, scripts: Sequence[Extraction], options: Options
) -> Mapping[str, ScriptRun]:
    """Run scripts once, each with much time, and on after a part that fails."""
    store = options.run_store()
    pairs = zip(jobs(scripts), scripts, strict=True)
    old_runs = store.get_runs([store.inputs(job, extraction.data) for job, extraction in pairs])
    known_runs = {path: run for path, run in old_runs.items() if run.outcome is Outcome.OK}
    patient = [
        extraction
        if "timeout=" in extraction.script.span.first_line().text
        else replace(extraction, script=replace(extraction.script, timeout=_LONG_TIMEOUT))
        for extraction in scripts
    ]
    patient = [mark_cells(extraction) for extraction in patient]
    write_examples(options.root, {extraction.path: extraction.data for extraction in patient})
    runs = run_scripts(course, patient, options, known_runs=known_runs, keeps_going=True)
    return {run.path: run for run in runs}


def _run_again(
    first_runs: Mapping[str, ScriptRun],
    changed_paths: Collection[str],
    options: Options,
    findings: Findings,
) -> None:
    """Run once more what has changed, and what is recorded from its only run; write what differs.

    Of a script that was whole in the first run as well, what differs varies from run to run.
    """
    course = _load(options)
    assert course is not None  # it was read before
    scripts = extract_scripts(course, options).runnable
    whole_runs = [run for path, run in first_runs.items() if path not in changed_paths]
    record_runs(scripts, whole_runs, options)
    _draw(course, whole_runs, options, findings)
    recordings = defaultdict[str, list[Recording]](list)
    for recording in recorded_outputs(course):
        recordings[recording.script or ""].append(recording)
    again = [
        extraction
        for extraction in scripts
        if extraction.path in changed_paths
        or (
            (run := first_runs[extraction.path]).outcome is Outcome.OK
            and run.unrepeated
            and not extraction.script.once
            and (recordings[extraction.path] or extraction.script.figures)
        )
    ]
    if not again:
        findings.write({})
        return
    store = options.run_store()
    store.begin()
    run_options = replace(options, long=True, on_start=lambda path, _: store.note_start(path))
    fresh = options.run_store(fresh=True)
    runs = run_scripts(course, again, run_options, "running scripts again", fresh)
    edits = defaultdict[Source, list[Edit]](list)
    for extraction, script_run in zip(again, runs, strict=True):
        script, changes = extraction.script, edits[extraction.script.span.source]
        if script_run.outcome is Outcome.OK and script.path not in changed_paths:
            first = first_runs[script.path]
            varying = [*_mark_varying(recordings[script.path], course, first, script_run)]
            if varying:
                changes += varying
                message = f"{script.path}: two runs differ, so an output is `volatile`"
                findings.add(Rank.CHANGED, message)
                continue
        keys = [*_missing_keys(script, script_run, math.inf)]
        _settle(script, script_run, course, keys, options, findings, edits)
    findings.write(edits)
    record_runs(again, runs, options)
    _draw(course, runs, options, findings)
    findings.write({})


def _draw(course: Course, runs: Sequence[ScriptRun], options: Options, findings: Findings) -> None:
    for remark in write_figures(course, None, runs, options, dry_run=False)[0]:
        findings.add(Rank.DRAWN, remark)


def _settle(
    script: model.Script,
    script_run: ScriptRun,
    course: Course,
    keys: list[str],
    options: Options,
    findings: Findings,
    edits: Mapping[Source, list[Edit]],
) -> Chain:
    """Make the edits that a run asks for: keys, cells that are only shown, what was printed."""
    recordings = recorded_outputs(course) if script_run.outcome is Outcome.FAILED else []
    cells, changes = Chain(script, script_run, recordings), edits[script.span.source]
    if script_run.outcome is Outcome.FAILED:
        changes += cells.edits(keys)
    for rank, message, place in cells.findings:
        findings.add(rank, message, place)
    if not cells.is_changed:
        keys += _divergence_keys(script, script_run)
        if cells.modules and not script.requires:
            keys.insert(0, f"requires={','.join(cells.modules)}")
        changes += _add_keys(script, keys, findings)
    if cells.is_changed or script_run.outcome is Outcome.OK:
        failing_parts = {*cells.failures, *cells.reasons} if cells.is_changed else ()
        changes += _record_outputs(script, script_run, course, options, findings, failing_parts)
        changes += _write_values(script, script_run, failing_parts)
    return cells


def _add_keys(script: model.Script, keys: Sequence[str], findings: Findings) -> Iterator[Edit]:
    if keys:
        head = script.span.first_line()
        end = head.start + len(head.text.partition(" {#")[0].rstrip())
        yield Edit(Span(script.span.source, end, end), f" {' '.join(keys)}")
        findings.add(Rank.CHANGED, f"{script.path} got `{' '.join(keys)}`")


def keep_notebook_outputs(outputs: Sequence[tuple[str, str]], store: Store) -> None:
    """Remember what is recorded in notebooks below parts of scripts, given by their paths."""
    for path, text in outputs:
        store.put(NOTEBOOK_OUTPUT, fingerprint((path, text.strip())), b"")


def _load(options: Options) -> Course | None:
    return load(options.root, code="run" if options.sandbox is None else "refuse").value


def _missing_keys(
    script: model.Script, script_run: ScriptRun, most_seconds: float
) -> Iterator[str]:
    """Yield the keys that a script's fence needs after this run, as `key=value`."""
    if script_run.outcome is Outcome.TIMEOUT:
        yield "norun"
    limit = script_run.seconds * _TIME_FACTOR
    has_time = "timeout=" in script.span.first_line().text
    did_end = script_run.outcome in (Outcome.OK, Outcome.FAILED) and not script_run.recorded
    if did_end and script_run.seconds > most_seconds and not (has_time or script.once):
        yield "record=once"
    if did_end and limit > script.timeout and not has_time:
        yield f"timeout={math.ceil(limit / 10) * 10}"
    folders = {
        f"{posixpath.dirname(effect.target)}/"
        for effect in (script_run.trace.effects if script_run.trace is not None else ())
        if effect.kind is EffectKind.WRITE and not effect.target.startswith(("/", ".."))
        if posixpath.dirname(effect.target)
    }
    if folders and not script.writes:
        yield f"writes={','.join(sorted(folders))}"


def _divergence_keys(script: model.Script, script_run: ScriptRun) -> Iterator[str]:
    divergences = script_run.trace.divergences if script_run.trace is not None else ()
    signs = {divergence.sign for divergence in divergences}
    if signs - {Sign.CONTACT} and not script.diverges:
        yield "diverges"
    if Sign.CONTACT in signs and not script.deep:
        yield "deep"


# --- what a script printed


def _record_outputs(
    script: model.Script,
    script_run: ScriptRun,
    course: Course,
    options: Options,
    findings: Findings,
    failing_parts: Container[int],
) -> Iterator[Edit]:
    """Yield the edits that write what a script printed where nothing or an import's is recorded.

    Of the outputs that an import wrote, those that do not hold here are replaced, with a remark.
    """
    recordings = [r for r in recorded_outputs(course) if r.script == script.path]
    for recording in recordings:
        comparison = course.comparison_of(recording)
        printed = script_run.output_of(recording.part)
        text = recording.body.text if isinstance(recording.body, Excerpt) else ""
        changes = compare(recording, comparison, printed).changes
        entry = fingerprint((script.path, text.strip()))
        is_imported = options.store.peek(NOTEBOOK_OUTPUT, entry, bytes) is not None
        if recording.part in failing_parts or (text.strip() and not (is_imported and changes)):
            continue
        edit = update_body(recording, comparison, printed)
        if isinstance(edit, Edit):
            yield edit
            keep_notebook_outputs([(script.path, printed)], options.store)
            if text.strip():
                message = f": {_describe_changes(changes)}"
                findings.add(Rank.RECORDED, message, recording.body_span)
                for place, message in _find_old_numbers(recording, changes, printed):
                    findings.add(Rank.SAID, message, place)
    recorded_parts = {recording.part for recording in recordings}
    for part, block in enumerate(script.parts or (script,)):
        printed = script_run.output_of(part)
        if printed.strip() and part not in recorded_parts and part not in failing_parts:
            end, text = block.span.end, marks.fence("output", printed.rstrip("\n"))
            below = f"\n\n{text}".replace("\n", f"\n{block.prefix}")
            yield Edit(Span(block.span.source, end, end), below)
            keep_notebook_outputs([(script.path, printed)], options.store)


_VALUE_PLACE = regex(r"`(?P<name>[^`:\n]+)(?::(?P<format>[^`\n]+))? = \?`")
"""Where a text shows a value that its tool computed, as the first pass has left it."""


def _write_values(
    script: model.Script, script_run: ScriptRun, failing_parts: Container[int]
) -> Iterator[Edit]:
    """Yield the edits that write a value which a script printed where its text asks for it."""
    source, parts = script.span.source, range(len(script.parts or (script,)))
    printed = "".join(script_run.output_of(part) for part in parts if part not in failing_parts)
    for place in _VALUE_PLACE.finditer(source.text):
        line = re.search(rf"^{re.escape(place['name'])}:[ ]*([^`\n]*\S)", printed, re.MULTILINE)
        if line is not None and line[1][0] != "<":  # an object that no words stand for
            value, words = line[1], ""
            if _NUMBER.fullmatch(value):
                value, words = format(float(value), place["format"] or ""), f' "{place["name"]}"'
                value = value if place["format"] else line[1]
            new = f"`{value}`{{out={script.path}{words}}}"
            yield Edit(Span(source, *place.span()), new)


def _describe_changes(changes: Sequence[Change]) -> str:
    recorded, printed = (
        f"`{shorten(text, 60, placeholder='…')}`" if text else "nothing"
        for text in (changes[0].recorded, changes[0].printed)
    )
    rest = f", and {plural(len(changes) - 1, 'more difference')}" if changes[1:] else ""
    return (
        "the recorded output does not hold here and is replaced: "
        f"{recorded} was recorded, {printed} is printed{rest}"
    )


def _find_old_numbers(
    recording: Recording, changes: Sequence[Change], printed: str
) -> Iterator[tuple[Span, str]]:
    """Yield the places of a text that say a number which was recorded, and is printed no more."""
    source, body = recording.span.source, recording.body_span
    for change in changes:
        digits = re.sub(r"\D", "", change.recorded)
        pattern = rf"(?<![\w.]){re.escape(change.recorded)}(?![\w]|\.\d)"
        if change.relative_error is None or len(digits) < 3 or re.search(pattern, printed):
            continue  # no number, or one that stands elsewhere by accident, or is still printed
        for match in re.finditer(pattern, source.text):
            if not body.start <= match.start() < body.end:
                old, new = change.recorded, change.printed
                message = f" says `{old}` as was recorded, but `{new}` is printed"
                yield Span(source, *match.span()), message


# --- what varies from run to run

_NUMBER = regex(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|[-+]?\.\d+(?:[eE][-+]?\d+)?|0x[0-9a-f]+")
_ANY_NUMBER = r"[-+.0-9a-fxE]+"
_WORDS_BEFORE = regex(r"[^\W\d](?:[^\W\d]|[ .,:;=()/%-])*\Z")
_MOST_PATTERNS = 4


def _mark_varying(
    recordings: Iterable[Recording], course: Course, first: ScriptRun, second: ScriptRun
) -> Iterator[Edit]:
    """Yield the edits that say which recorded outputs are not the same in two runs of a script."""
    for recording in recordings:
        texts = [run.output_of(recording.part) for run in (first, second)]
        comparison = course.comparison_of(recording)
        results = [compare(recording, comparison, text).changes for text in texts]
        is_borne_out = not all(results)
        is_said = recording.comparison is not None or isinstance(recording.body, model.Table)
        if texts[0] == texts[1] or not any(results) or is_said:
            continue
        pattern = varying_pattern(*texts)
        at = recording.body_span.start - 1  # the end of the line that opens the fence
        place = Span(recording.span.source, at, at)
        if pattern:
            yield Edit(place, f' digits volatile="{pattern}"')
        elif is_borne_out:
            yield Edit(place, " volatile")


def varying_pattern(first: str, second: str) -> str:
    """Return a pattern of the numbers that differ in two outputs, with the words before them.

    Empty where the outputs differ in anything else, or where nothing would be left to compare.
    """
    patterns = dict[str, None]()
    if _NUMBER.split(first) != _NUMBER.split(second):
        return ""
    for number, changed in zip(_NUMBER.finditer(first), _NUMBER.finditer(second), strict=True):
        if number[0] == changed[0]:
            continue
        words = _WORDS_BEFORE.search(first, 0, number.start())
        if words is None:
            return ""
        patterns[re.sub(r"([.()])", r"[\1]", words[0]) + _ANY_NUMBER] = None
    pattern = "|".join(patterns)
    rest = re.sub(pattern, "", first)
    is_enough = len(patterns) <= _MOST_PATTERNS and re.search(r"\w{2}", rest) is not None
    return pattern if is_enough and rest == re.sub(pattern, "", second) else ""
