"""`coursebuild explain`: explain a rule, or why something would run again.

Of a path it says whether it would run again, why, and what depends on it; of a line of a lesson,
where its values come from. The lessons are read and parsed; nothing is run, compiled or written,
and neither NumPy nor MuJoCo is imported.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Sequence
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.resources import rules_page
from coursebuild.core.model import (
    Course,
    Document,
    ExampleTarget,
    FeatureBlock,
    Image,
    Lesson,
    Link,
    ModelTarget,
    NumberBinding,
    Table,
    UrlTarget,
    block_inlines,
    document_blocks,
    find_inlines,
    local_file,
    walk_inlines,
)
from coursebuild.core.model.lesson_record import known_addresses
from coursebuild.core.model.report_files import BENCH, ENGINES
from coursebuild.core.registry import feature_trials, installed_features
from coursebuild.core.run.dependencies import Kind, describe, is_there, sought_files, state_changes
from coursebuild.core.run.mjcf import existing_files
from coursebuild.core.run.run_record import RunRecord
from coursebuild.core.scripts.bindings import check_bindings
from coursebuild.core.scripts.bound_numbers import text_places
from coursebuild.core.scripts.bound_places import BoundNumber, bound_values
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract, jobs
from coursebuild.core.scripts.lines import plain_text
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.table_cells import row_values, table_rows
from coursebuild.core.text.characters import printable
from coursebuild.core.text.near import nearest
from coursebuild.core.text.rules import RULES, Rule
from coursebuild.output import CLEAN, write
from coursebuild.pipeline.arguments import add_format, options_of, style_of
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.options import Options, UsageError, documents_by_name, path_from_root
from coursebuild.report.text import BOLD, FAINT, GREEN, YELLOW, Style, location
from coursebuild.report.values import json_text, plain, plural

State = Literal["remembered", "would run", "norun"]


class RunExplanation(Struct, frozen=True):
    """Whether a script or a lab would run now, and why."""

    kind: Literal["script", "lab"]
    name: str
    """A script's path, or a lab's name."""
    owner: str
    """Id of its lesson or page."""
    state: State
    reasons: tuple[str, ...] = ()
    """Why it would run, or never does, each a clause."""
    depends: tuple[str, ...] = ()
    """What its last result depends on, a line for each."""
    made: int | None = None
    """When its last result was made, in seconds since 1970."""
    seconds: float | None = None
    outcome: str = ""
    """How its last run ended; empty where there was none."""


class Explanation(Struct, frozen=True):
    """What is known of a path."""

    path: str
    kind: Literal["script", "lab", "lesson", "page", "model", "file"]
    runs: tuple[RunExplanation, ...]
    """Those of the script or lab, or of all scripts and labs of a lesson or page."""
    dependents: tuple[RunExplanation, ...] = ()
    """Scripts and labs whose results depend on it."""
    files: tuple[str, ...] = ()
    """The other files of which a model consists."""
    part_of: tuple[str, ...] = ()
    """The models that include it."""
    shown_in: tuple[str, ...] = ()
    """Files of the lessons and pages that show it, link to it or quote its output."""


def rule_text(rule: Rule, page: str) -> str:
    """What a rule means: its section of the page of rules, or else its summary."""
    section = re.search(rf"^### {rule.name}\n+(.*?)\s*(?=^##|\Z)", page, re.DOTALL | re.MULTILINE)
    text = section[1] if section else rule.summary
    return f"{rule.name}\n\n{text}\n"


def explanation_text(explanation: Explanation, style: Style) -> str:
    """Return an explanation as text for people."""
    e = explanation
    is_run, heading = e.kind in ("script", "lab"), printable(e.path)
    kinds = [run.kind for run in e.runs]
    if kinds and e.kind not in ("model", "file"):
        counts = [plural(kinds.count(kind), kind) for kind in ("script", "lab") if kind in kinds]
        count = sum(run.state == "would run" for run in e.runs)
        heading += f": {' and '.join(counts)}, of which {count or 'none'} would run"
    elif e.kind not in ("model", "file"):
        heading += " has no scripts and no labs"
    parts = [] if is_run else [style.paint(heading, BOLD)]
    parts += ["\n".join(_run_lines(run, style, full=is_run)) for run in e.runs]
    if e.files:
        parts.append(_block("consists also of", e.files))
    if e.part_of:
        parts.append(_block("is a part of", e.part_of))
    if e.dependents:
        lines = [line for run in e.dependents for line in _run_lines(run, style)]
        parts.append("\n".join(["depending on it:", *(f"  {line}" for line in lines)]))
    elif e.kind in ("model", "file"):
        parts.append("no result of a script or lab depends on it")
    if e.shown_in:
        parts.append(_block("shown, linked or quoted in", e.shown_in))
    return "\n\n".join(parts) + "\n"


def _block(head: str, lines: tuple[str, ...]) -> str:
    return "\n".join([f"{head}:", *(f"  {printable(line)}" for line in lines)])


def _run_lines(run: RunExplanation, style: Style, *, full: bool = False) -> list[str]:
    name = style.paint(printable(run.name), BOLD) if full else printable(run.name)
    verb = "run" if run.kind == "script" else "be tried"
    again = " again" if run.made is not None else ""
    verdicts = {
        "remembered": style.paint("is remembered", GREEN),
        "norun": "is never run",
        "would run": style.paint(f"would {verb}{again}", YELLOW),
    }
    lines = [f"{name} {verdicts[run.state]}"]
    lines += [f"  because {printable(reason)}" for reason in run.reasons]
    if not full:
        return lines
    last = "not run yet on this machine"
    if run.made is not None and run.seconds is not None:
        time_text = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(run.made))
        last = f"last run {time_text}, {run.seconds:.2f} s: {run.outcome}"
    lines.append(style.paint(f"  of {run.owner}, {last}", FAINT))
    if run.depends:
        lines += ["", "its last result depends on:"]
        lines += [f"  {printable(line)}" for line in run.depends]
    return lines


EXAMPLES = """\
examples:
  coursebuild explain output-drift             a rule, as in error[output-drift]
  coursebuild explain 4.2                      would the scripts of a lesson run, and why?
  coursebuild explain models/pendulum.xml      what depends on this file?
  coursebuild explain content/lessons/1.1-pendulum.md:8    where do its numbers come from?
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    help = "a rule; a script, lab, lesson, page, model, or any file; or a line of a lesson"
    parser.add_argument("name", metavar="RULE|PATH[:LINE]", help=help)
    add_format(parser, "text", "json")


def run(arguments: argparse.Namespace) -> int:
    """Print what is known of a rule or a path."""
    installed_features()  # they have rules of their own
    name = arguments.name
    if name not in RULES:
        options = options_of(arguments)
        course = load_course(options.root)  # whose own features have some too
    value: object
    if name in RULES:
        value, text = RULES[name], rule_text(RULES[name], rules_page())
    elif match := re.fullmatch(r"(.+\.(?:md|toml)):([1-9][0-9]{0,8})", name):
        path = path_from_root(match[1], options.root)
        value = origins = value_origins(course, path, int(match[2]))
        text = origins_text(f"{path}:{match[2]}", origins)
    else:
        explanation = _Explainer(course, options).explain(name)
        value = plain(explanation, runs="own", shown_in="shown")
        text = explanation_text(explanation, style_of(sys.stdout))
    return write(json_text(value) if arguments.format == "json" else text, CLEAN)


class _Explainer:
    def __init__(self, course: Course, options: Options) -> None:
        self.course = course
        self.root = options.root
        self.run_store = options.for_course(course).run_store()
        sources = [model.source for model in course.models]
        self.models = {s.path: existing_files(options.root, s.path, s.text) for s in sources}
        extractions = extract(course).value
        self.documents = documents_by_name(course)
        pairs = zip(extractions, jobs(extractions), strict=True)
        self.scripts = {extraction.path: (extraction, job) for extraction, job in pairs}
        self.labs = {
            name: (inputs, trial)
            for name, (kind, trial) in feature_trials(course).items()
            if (inputs := kind.inputs(trial)) is not None
        }

    def explain(self, name: str) -> Explanation:
        path = path_from_root(name, self.root)
        for candidate in (name, path):
            explanation = self._find_by_name(candidate)
            if explanation is not None:
                return explanation
        explanation = self._explain_file(path, "file")
        is_known = explanation.dependents or explanation.part_of or (self.root / path).exists()
        if not is_known:
            closest = nearest(name, [*self.scripts, *self.labs, *self.documents, *RULES])
            help = f"did you mean `{closest}`?" if closest is not None else ""
            raise UsageError(f"nothing in this course is called `{name}`", help=help)
        return explanation

    def _find_by_name(self, name: str) -> Explanation | None:
        if name in self.scripts:
            run, users = self._explain_script(name), self._documents_using(name)
            return Explanation(name, "script", (run,), self._find_dependents(name), shown_in=users)
        if name in self.labs:
            return Explanation(name, "lab", (self._explain_lab(name),))
        part = self.documents.get(name)
        if part is not None:
            scripts = [p for p, (e, _) in self.scripts.items() if e.document == part.path]
            labs = [n for n, (_, trial) in self.labs.items() if trial.block.span.path == part.path]
            runs = (*map(self._explain_script, scripts), *map(self._explain_lab, labs))
            return Explanation(part.path, "lesson" if isinstance(part, Lesson) else "page", runs)
        for model in self.course.models:
            if name in (model.name, model.source.path):
                return self._explain_file(model.source.path, "model")
        return None

    def _explain_file(self, path: str, kind: Literal["model", "file"]) -> Explanation:
        return Explanation(
            path,
            kind,
            runs=(),
            dependents=self._find_dependents(path),
            files=self.models.get(path, ()),
            part_of=tuple(model for model, files in self.models.items() if path in files),
            shown_in=self._documents_using(path),
        )

    # --- scripts and labs

    def _explain_script(self, path: str) -> RunExplanation:
        extraction, job = self.scripts[path]
        if not extraction.is_run:
            script = extraction.script
            reason = "its lesson says `norun`"
            if not script.norun:
                reason = f"`[runners]` of the map has nothing for `{script.language}`"
            return RunExplanation("script", path, extraction.owner, "norun", (reason,))
        inputs = self.run_store.inputs(job, extraction.data)
        record = self.run_store.get_record(inputs)
        if record is not None:
            return _describe_run("script", path, extraction.owner, record)
        last, reasons = self.run_store.last_record(path), self.run_store.reasons(inputs)
        return _describe_run("script", path, extraction.owner, last, reasons)

    def _explain_lab(self, name: str) -> RunExplanation:
        inputs, trial = self.labs[name]
        last, states = self.run_store.last_record(inputs.path), self.run_store.states
        holds = last is not None and not last.reason_forgotten and last.inputs == inputs
        if holds and last is not None and not any(state_changes(last.dependencies, states)):
            return _describe_run("lab", name, trial.owner, last)
        return _describe_run("lab", name, trial.owner, last, self.run_store.reasons(inputs))

    def _find_dependents(self, path: str) -> tuple[RunExplanation, ...]:
        dependents = []
        for script in self.scripts:
            if script != path and self._depends(self.run_store.last_record(script), path):
                dependents.append(self._explain_script(script))
        for name, (inputs, trial) in self.labs.items():
            models = [f"models/{model}.xml" for model in trial.block.models()]
            if path in models or self._depends(self.run_store.last_record(inputs.path), path):
                dependents.append(self._explain_lab(name))
        return tuple(dependents)

    def _depends(self, last: RunRecord | None, path: str) -> bool:
        folder = path.rpartition("/")[0]
        return last is not None and any(
            (d.kind is Kind.FILE and d.name == path)
            or (d.kind is Kind.LISTING and d.name in (path, folder))
            or (d.kind is Kind.SOUGHT and path in sought_files(d.name))
            for d in last.dependencies
        )

    # --- pages

    def _documents_using(self, path: str) -> tuple[str, ...]:
        return tuple(d.source.path for d in self.course.documents if _uses(d, path))


def _uses(document: Document, path: str) -> bool:
    for block in document_blocks(document):
        if isinstance(block, FeatureBlock):
            mentioned = block.mentioned_models()
            models = {f"models/{model}.xml" for model in (*block.models(), *mentioned)}
            if path in models.union(map(BENCH.path, mentioned), map(ENGINES.path, mentioned)):
                return True
        for inline in walk_inlines(block_inlines(block)):
            shown_path = None
            match inline:
                case Link(target=UrlTarget(url=url)) if "://" in url:
                    pass
                case Image(url=url) | Link(target=UrlTarget(url=url)):
                    shown_path = local_file(url, document.source.path)
                case Link(target=ModelTarget(name=name)):
                    shown_path = f"models/{name}.xml"
                case Link(target=ExampleTarget(path=example)):
                    shown_path = example
                case NumberBinding(script=script):
                    shown_path = script
                case _:
                    pass
            if shown_path == path:
                return True
    return False


def _describe_run(
    kind: Literal["script", "lab"],
    name: str,
    owner: str,
    record: RunRecord | None,
    reasons: Sequence[str] = (),
) -> RunExplanation:
    state: State = "would run" if reasons else "remembered"
    explanation = RunExplanation(kind, name, owner, state, tuple(reasons))
    if record is None:
        return explanation
    depends = [describe(d) for d in record.dependencies if is_there(d)]
    depends += [f"{subject}: {value}" for subject, value in record.inputs.conditions]
    run = record.stored_run
    last = {"made": record.timestamp, "seconds": run.seconds, "outcome": run.outcome.value}
    return replace(explanation, depends=tuple(dict.fromkeys(depends)), **last)


class ValueOrigin(Struct, frozen=True):
    """Where a shown value comes from."""

    text: str
    script: str = ""
    """Empty for one that its author gives."""
    places: tuple[str, ...] = ()
    """The printed line in words, and the place in it; several where the author chose none."""
    recorded: tuple[str, ...] = ()
    """Where these are recorded in the lesson."""
    source: str = ""
    """That of a given value."""


def value_origins(course: Course, path: str, line: int) -> tuple[ValueOrigin, ...]:
    """The values that a line of a lesson or page shows."""
    document = next((d for _, d in course.shown_texts if d.source.path == path), None)
    if document is None:
        raise UsageError(f"{path} is no lesson or page of this course, and binds no number")
    if line > len(document.source.line_starts):
        raise UsageError(f"{path} has no line {line}")
    paths = [extraction.path for extraction in extract(course).value]
    addresses = known_addresses(course.records)
    outputs = PrintedOutputs(verify(course, (), addresses), (), paths)
    check_bindings(document, outputs, addresses)

    origins = [
        (number.span, ValueOrigin(number.text, source=number.source or "no source"))
        for number in find_inlines(document, NumberBinding)
        if number.source is not None
    ]
    for binding, value in bound_values(document, outputs):
        at = addresses.get(value, ())
        bound = BoundNumber(binding, outputs, at)
        texts = tuple(f"number {a.place + 1} of {a.description}" for a in at)
        if bound.text.numbers:
            places = [place for group in bound.groups for place in bound.look_up(group)]
            spans = [place.span for place in places if place.span is not None]
            if not at and any(place.address is None for place in places):
                texts = tuple(
                    f"number {place.first + 1} of `{plain_text(place.line.text)}`, which has its "
                    "words in common with other lines"
                    for place in places
                )
        else:
            lines = [line for text in bound.recorded for line in text.lines]
            words = [*text_places(bound.text.before, lines)]
            texts = tuple(
                dict.fromkeys(f"words of `{plain_text(line.text)}`" for line, *_ in words)
            )
            texts = texts or ("words of a line that is not recorded",)
            spans = [line.locate(*at) for line, *at in words if line.locate is not None]
        origin = ValueOrigin(binding.text, value.script, texts, tuple(map(location, spans)))
        origins.append((binding.span, origin))
    for verdict in outputs.of_document(document):
        body, filters = verdict.recording.body, verdict.comparison.filters
        rows = table_rows(body, filters) if isinstance(body, Table) else ()
        for row, value in zip(rows, row_values(document, verdict.recording, filters), strict=True):
            at = addresses.get(value, ())
            texts = tuple(f"number {a.place + 1} of {a.description}" for a in at)
            span = row[0].cell.span.to(row[-1].cell.span)
            origins.append((span, ValueOrigin(value.text, value.script, texts)))
    return tuple(origin for span, origin in origins if span.line <= line <= span.end_line)


def origins_text(place: str, origins: tuple[ValueOrigin, ...]) -> str:
    """What is known of the values on a line, as text for people."""
    lines = [f"{printable(place)} shows {plural(len(origins), 'value') if origins else 'no value'}"]
    for origin in origins:
        if not origin.script:
            answer = f"given: {origin.source}" if origin.source else "bound to no script"
            lines.append(f"  `{printable(origin.text)}` is {answer}")
            continue
        places = origin.places or ("a line that is not known yet: run `coursebuild check`",)
        lines.append(f"  `{printable(origin.text)}` is printed by {printable(origin.script)}")
        lines += [f"    {printable(text)}" for text in places]
        lines += [f"    recorded at {printable(at)}" for at in origin.recorded]
    return "\n".join(lines) + "\n"
