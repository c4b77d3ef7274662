"""`coursebuild import --prove`: run what was imported, and write what running shows.

A lesson of cells is a chain of states. A cell that cannot run is shown, with the reason, and so are
those below it that need what it would define; all others remain parts of the script. Where only a
module is missing, its import alone is taken out of the cell. A script that is no chain of cells
gets keys: `requires` for a module that it misses, `timeout` where it needs more time, `writes`,
`diverges`, `deep`.
"""

from __future__ import annotations

import math
import posixpath
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from textwrap import shorten

from msgspec.structs import replace

from coursebuild.api import (
    Course,
    Edit,
    Excerpt,
    Options,
    Outcome,
    ScriptRun,
    Source,
    Span,
    Store,
    marks,
    model,
)
from coursebuild.core.files.write import FileChange
from coursebuild.core.model.results import Change, EffectKind, Sign
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.values import fingerprint
from coursebuild.features.importer.chain import Chain, missing_module
from coursebuild.features.importer.convert import change_tried_lessons
from coursebuild.pipeline.load import load
from coursebuild.pipeline.recordings import read_recorded, write_figures
from coursebuild.pipeline.scripts import extract_scripts, recorded_outputs
from coursebuild.pipeline.scripts import run as run_scripts
from coursebuild.report.values import plural

NOTEBOOK_OUTPUT = "notebook-output"
"""The kind of entries that say: this is recorded in a notebook, and may be replaced."""
_LONG_TIMEOUT = 900.0
"""Seconds allowed in the second run of a script that exceeded the usual time."""
_TIME_FACTOR = 3.0
"""A script's new time limit, as a multiple of the time it took here."""
_ROUNDS = 8
"""How often cells are taken out of a script; the last time, all from the failing one on."""
_HEADING = "\n## What running showed\n\n"


def prove(options: Options) -> tuple[str, ...]:
    """Run the scripts of an imported course, and write what that shows into its files.

    Returns remarks on what is new. Scripts whose runs are remembered do not run again.
    """
    remarks: list[str] = []
    for number in range(_ROUNDS + 1):
        course = _load(options)
        if course is None:
            return tuple(remarks)
        scripts = extract_scripts(course, options).runnable
        runs = _run(course, scripts, options)
        edits: dict[Source, list[Edit]] = {}
        for extraction, script_run in runs:
            if script_run.outcome is Outcome.FAILED and number < _ROUNDS:
                is_last = number == _ROUNDS - 1
                recordings = recorded_outputs(course)
                chain = Chain(extraction.script, script_run, recordings)
                changes = [*chain.edits(is_prefix=is_last)]
                if changes:
                    edits.setdefault(extraction.script.span.source, []).extend(changes)
                    remarks += chain.remarks
        if not edits:
            break
        _write(options, edits)
    assert course is not None  # it was read in each round
    edits = {}
    for extraction, script_run in runs:
        script = extraction.script
        changes = edits.setdefault(script.span.source, [])
        keys = " ".join(_missing_keys(script, script_run))
        if keys:
            end = script.span.first_line().end
            changes.append(Edit(Span(script.span.source, end, end), f" {keys}"))
            remarks.append(f"{script.path} got `{keys}`")
        if script_run.outcome is Outcome.OK:
            changes += _record_outputs(extraction.script, script_run, course, options, remarks)
    _write(options, edits)
    figures, _ = write_figures(course, None, [run for _, run in runs], options, dry_run=False)
    remarks += figures
    _write_remarks(options, remarks)
    return tuple(remarks)


def keep_notebook_outputs(outputs: Sequence[tuple[str, str]], store: Store) -> None:
    """Remember what is recorded in notebooks below parts of scripts, given by their paths."""
    for path, text in outputs:
        store.put(NOTEBOOK_OUTPUT, fingerprint((path, text.strip())), b"")


def _load(options: Options) -> Course | None:
    return load(options.root, code="run" if options.sandbox is None else "refuse").value


def _write(options: Options, edits: Mapping[Source, Sequence[Edit]]) -> None:
    file_changes = (
        FileChange(source.path, source.text.encode(), apply_edits(source.text, changes).encode())
        for source, changes in edits.items()
    )
    lessons = [change for change in file_changes if change.new != change.old]
    change_tried_lessons(options.root, lessons, options.store)


def _write_remarks(options: Options, remarks: Sequence[str]) -> None:
    """Write what is new into the account, in place of what was new before."""
    old = read_recorded(options.root, "IMPORT.md")
    if old is None or not remarks:
        return
    text = old.decode("utf-8", "replace").partition(_HEADING)[0]
    new = f"{text}{_HEADING}" + "".join(f"- {remark}\n" for remark in remarks)
    if new.encode() != old:
        changes = [FileChange("IMPORT.md", old, new.encode())]
        change_tried_lessons(options.root, changes, options.store)


def _run(
    course: Course, scripts: Sequence[Extraction], options: Options
) -> list[tuple[Extraction, ScriptRun]]:
    """Run the scripts, those that took too long once more with more time."""
    runs = list(zip(scripts, run_scripts(course, scripts, options), strict=True))
    slow = [extraction for extraction, run in runs if run.outcome is Outcome.TIMEOUT]
    retried = [replace(e, script=replace(e.script, timeout=_LONG_TIMEOUT)) for e in slow]
    reruns = {
        run.path: run for run in run_scripts(course, retried, options, "running slow scripts")
    }
    return [(extraction, reruns.get(extraction.path, run)) for extraction, run in runs]


def _missing_keys(script: model.Script, script_run: ScriptRun) -> Iterator[str]:
    """Yield the keys that a script's fence needs after this run, as `key=value`."""
    module = missing_module(script_run) if script_run.outcome is Outcome.FAILED else ""
    if module and not script.requires:
        yield f"requires={module}"
    if script_run.outcome is Outcome.TIMEOUT:
        yield "norun"
    limit = script_run.seconds * _TIME_FACTOR
    is_slow = script_run.outcome is Outcome.OK and limit > script.timeout
    if is_slow and "timeout=" not in script.span.first_line().text:
        yield f"timeout={math.ceil(limit / 10) * 10}"
    trace = script_run.trace
    signs = {d.sign for d in trace.divergences} if trace is not None else set()
    if signs - {Sign.CONTACT} and not script.diverges:
        yield "diverges"
    if Sign.CONTACT in signs and not script.deep:
        yield "deep"
    folders = {
        f"{posixpath.dirname(effect.target)}/"
        for effect in (trace.effects if trace is not None else ())
        if effect.kind is EffectKind.WRITE and not effect.target.startswith(("/", ".."))
        if posixpath.dirname(effect.target)
    }
    if folders and not script.writes:
        yield f"writes={','.join(sorted(folders))}"


# --- what a script printed


def _record_outputs(
    script: model.Script,
    script_run: ScriptRun,
    course: Course,
    options: Options,
    remarks: list[str],
) -> Iterator[Edit]:
    """Yield the edits that write what a script printed where nothing or a notebook's is recorded.

    Of a notebook's outputs, those that do not hold here are replaced, with a remark.
    """
    recordings = [r for r in recorded_outputs(course) if r.script == script.path]
    for recording in recordings:
        comparison = course.comparison_of(recording)
        printed = script_run.output_of(recording.part)
        verdict = compare(recording, comparison, printed)
        text = recording.body.text if isinstance(recording.body, Excerpt) else ""
        entry = fingerprint((script.path, text.strip()))
        is_notebook = options.store.peek(NOTEBOOK_OUTPUT, entry, bytes) is not None
        if text.strip() and not (is_notebook and verdict.changes):
            continue
        edit = update_body(recording, comparison, printed)
        if isinstance(edit, Edit):
            yield edit
            if text.strip():
                remarks.append(f"{recording.span.path}: {_describe_changes(verdict.changes)}")
    for part, block in enumerate(script.parts or (script,)):
        printed = script_run.output_of(part)
        is_recorded = any(recording.part == part for recording in recordings)
        if printed.strip() and not is_recorded:
            end, text = block.span.end, marks.fence("output", printed.rstrip("\n"))
            below = textwrap.indent(f"\n\n{text}", block.prefix, lambda line: True)
            yield Edit(Span(block.span.source, end, end), below.removeprefix(block.prefix))


def _describe_changes(changes: Sequence[Change]) -> str:
    recorded, printed = (
        f"`{text}`" if text else "nothing"
        for text in (
            shorten(t, 60, placeholder="…") for t in (changes[0].recorded, changes[0].printed)
        )
    )
    rest = f", and {plural(len(changes) - 1, 'more difference')}" if changes[1:] else ""
    return (
        "the recorded output does not hold here and is replaced: "
        f"{recorded} was recorded, {printed} is printed{rest}"
    )
