"""`coursebuild import --prove`: run what was imported, and write what running shows.

A lesson of cells is a chain of states. A cell that cannot run is shown, with the reason, and so are
those below it that need what it would define; all others remain parts of the script. Where only a
module is missing, its import alone is taken out of the cell. A script that is no chain of cells
gets keys: `requires` for a module that it misses, `timeout` where it needs more time, `writes`,
`diverges`, `deep`.
"""

from __future__ import annotations

import ast
import math
import posixpath
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence, Set
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
)
from coursebuild.core.files.write import FileChange
from coursebuild.core.model import Script, ScriptPart
from coursebuild.core.model.results import Change, EffectKind, Sign
from coursebuild.core.pages.marks import fence
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.values import fingerprint
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
_ROUNDS = 2
"""How often cells are taken out of a script; then all from the one on that fails."""
_MISSING_MODULE = re.compile(r"^ModuleNotFoundError: No module named '([\w.]+)'", re.MULTILINE)
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
                chain = _Chain(extraction, script_run, course)
                changes = [*chain.edits(is_prefix=number == _ROUNDS - 1)]
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
    drawn, _ = write_figures(course, None, [run for _, run in runs], options, dry_run=False)
    remarks += drawn
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


def _missing_keys(script: Script, script_run: ScriptRun) -> Iterator[str]:
    """Yield the keys that a script's fence needs after this run, as `key=value`."""
    if script_run.outcome is Outcome.FAILED and not script.requires:
        missing = _MISSING_MODULE.search(script_run.stderr)
        if missing is not None:
            yield f"requires={missing[1]}"
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
    script: Script, script_run: ScriptRun, course: Course, options: Options, remarks: list[str]
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
            end, text = block.span.end, fence("output", printed.rstrip("\n"))
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


# --- cells that cannot run


class _Chain:
    """The cells of a script that failed, as parts of it."""

    def __init__(self, extraction: Extraction, script_run: ScriptRun, course: Course) -> None:
        self.extraction, self.course = extraction, course
        self.script = extraction.script
        self.parts: tuple[Script | ScriptPart, ...] = self.script.parts or (self.script,)
        self.codes = [part.code.text for part in self.parts]
        self.remarks: list[str] = []
        name = re.escape(self.script.path)
        lines = re.findall(rf'File "[^"\n]*{name}", line (\d+)', script_run.stderr)
        starts = self.script.part_lines if self.script.parts else ()
        self.failing = sum(start <= int(lines[0]) for start in starts) if lines else None
        self.reason = (script_run.stderr.strip().splitlines() or ["it failed"])[-1]
        missing = _MISSING_MODULE.search(script_run.stderr)
        self.module = missing[1] if missing is not None else ""

    def edits(self, *, is_prefix: bool) -> Iterator[Edit]:
        """Yield the edits that show, and no longer run, what cannot.

        `is_prefix`: all from the cell on that failed.
        """
        if self.failing is None or not self.script.parts or self.script.requires:
            return
        imports, names = self._without_module()
        reasons: dict[int, str] = {}
        if is_prefix:
            reasons = dict.fromkeys(range(self.failing + 1, len(self.parts)), "a cell above fails")
            reasons[self.failing] = self.reason
        else:
            if not imports:
                reasons[self.failing] = self.reason
                names = _bound(self.codes[self.failing])
            for number in range(0 if imports else self.failing + 1, len(self.parts)):
                code = imports.get(number, self.codes[number])
                if needed := _used(code) & names:
                    words = " and ".join(f"`{name}`" for name in sorted(needed))
                    reasons[number] = f"{self.reason}: it needs {words}"
                    names |= _bound(code)
                else:
                    names -= _bound(code)
        if len(reasons) == len(self.parts):
            return  # nothing would be left of it: a key says why
        yield from self._edits(reasons, imports)
        count = plural(len(reasons), "cell") if reasons else "an import"
        self.remarks.append(f"{self.script.path}: {count} shown, not run: {self.reason}")

    def _without_module(self) -> tuple[dict[int, str], Set[str]]:
        """Return the cells that import a missing module without these imports, and their names."""
        cells: dict[int, str] = {}
        names = set[str]()
        for number, code in enumerate(self.codes) if self.module else ():
            lines = code.split("\n")
            for statement in ast.parse(code).body:
                match statement:
                    case ast.Import():
                        modules = [alias.name for alias in statement.names]
                    case ast.ImportFrom(module=str(module)):
                        modules = [module]
                    case _:
                        continue
                if any(f"{name}.".startswith(f"{self.module}.") for name in modules):
                    names |= {a.asname or a.name.split(".")[0] for a in statement.names}
                    first, last = statement.lineno - 1, statement.end_lineno or statement.lineno
                    lines[first:last] = [""] * (last - first)
            if (new := "\n".join(lines)) != code:
                cells[number] = re.sub(r"\n{3,}", "\n\n", new).strip("\n")
        return cells, names

    def _edits(self, reasons: Mapping[int, str], imports: Mapping[int, str]) -> Iterator[Edit]:
        source, figures = self.script.span.source, [f.name for f in self.script.figures]
        gone = [
            name
            for number in reasons
            for name in figures
            if f'plt.savefig("{name}")' in self.codes[number]
        ]
        shown = [number for number in reasons if number not in imports or reasons[number]]
        first = next(n for n in range(len(self.parts)) if n not in reasons)
        for number, part in enumerate(self.parts):
            code = self.codes[number]
            head = part.span.first_line().text.lstrip("`~ ")
            if number == first:  # it has the keys of the script
                own = re.search(r"\b(?:open|folded|hidden)\b", head)
                head = self.script.span.first_line().text.lstrip("`~ ")
                head = re.sub(r"\s+(?:open|folded|hidden)\b", "", head)
                kept = ",".join(name for name in figures if name not in gone)
                head = re.sub(r"\s+figure=\S+", f" figure={kept}" if kept else "", head)
                head = f"{head} {own[0]}" if own else head
            if number in shown:
                for name in gone:
                    lines = f'\nplt.savefig("{name}")\nplt.close("all")'
                    code = f"\n{code}".replace(lines, "").strip("\n")
                why = f"*Not run here: {reasons[number].replace('*', chr(92) + '*')}.*"
                new = f"{fence('python', code)}\n\n{why}" if code else why
            elif number in imports:
                taken = "\n".join(line for line in code.split("\n") if line not in imports[number])
                why = f"*Not run here: {self.reason}.*"
                new = f"{fence('python', taken)}\n\n{why}"
                if imports[number]:
                    new += f"\n\n{fence(head, imports[number])}"
            elif number == first:
                new = fence(head, code)
            else:
                continue
            indented = textwrap.indent(new, part.prefix, lambda line: True)
            yield Edit(part.span, indented.removeprefix(part.prefix))
        for recording in recorded_outputs(self.course):
            if recording.script == self.script.path and recording.part in reasons:
                line = recording.span.first_line()
                if "output" in line.text:
                    yield Edit(line, line.text.replace("output", "text", 1))
        for name in gone:
            pattern = rf"^[> ]*Figure: !\[[^\]\n]*\]\({re.escape(name)}\)[^\n]*\n?"
            if paragraph := re.search(pattern, source.text, re.MULTILINE):
                yield Edit(Span(source, paragraph.start(), paragraph.end()), "")


def _used(code: str) -> set[str]:
    return {
        node.id
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }


def _bound(code: str) -> set[str]:
    names = set[str]()
    for node in ast.walk(ast.parse(code)):
        match node:
            case ast.Name(id=name, ctx=ast.Store()):
                names.add(name)
            case ast.FunctionDef() | ast.ClassDef() | ast.AsyncFunctionDef():
                names.add(node.name)
            case ast.alias():
                names.add(node.asname or node.name.partition(".")[0])
            case _:
                continue
    return names
