"""What follows a save, in its own time: everything that a page need not wait for.

Entry point: `Behind.follow()`, which the main thread runs, so that Ctrl-C ends whatever is running
as it ends any other command.

1. When nothing was saved for a moment, the whole course is read again, if what was saved may
   concern more than its own page.
2. Models are compiled. The scripts that changed run, then all that have no remembered result; those
   of which the output is another than recorded run once more, so that it is known whether a new
   output can be offered. Labs are tried.
3. The rest of the pages is drawn, and the fonts are cut to what all of them need.
4. What is wrong is printed, where it is something else than before.

A save in between begins this anew; what was found stays as far as it holds. A script that runs is
ended only where it is another by now: the others go on.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from coursebuild.checks.quizzes import check_output_lines
from coursebuild.diagnostics import Diagnostic
from coursebuild.effects.errors import EffectError
from coursebuild.effects.locks import project_lock
from coursebuild.effects.runner import RunStoppedError, ScriptServer
from coursebuild.model import Course, Document
from coursebuild.pipeline.check import no_lessons
from coursebuild.pipeline.labs import Engines, labs_of, try_labs
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.preview.parts import Ran, extraction
from coursebuild.pipeline.preview.told import report_now
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.remember import Memory
from coursebuild.pipeline.verify import compile_models, extract_scripts, run
from coursebuild.report import Style, render_report
from coursebuild.results import CompileResult, LabResult, Outcome, ScriptRun
from coursebuild.scripts.extract import Extraction, jobs
from coursebuild.scripts.findings import script_findings

QUIET = 0.15
"""Seconds without a save after which the slow work begins."""
LONGEST = 2.0
"""Seconds after which it begins all the same."""
_BATCH = 16
"""Scripts whose results are waited for before they are shown."""
_FEW = 12
"""So many pages may be drawn before the scripts run, so that new characters have their font."""


class _SupersededError(Exception):
    """Something was saved in the meantime."""


class Behind:
    """See the module."""

    def __init__(self, live: LiveCourse, options: Options, progress: Progress) -> None:
        self._live = live
        self._options = options
        self._said = progress
        # Which scripts run is said on a terminal, where it is gone again when they are done.
        self._progress = progress if progress.live else Progress(quiet=True)
        self._seen = -1
        self._everything = True
        """Whether more may have changed than documents."""
        self._compiled: tuple[object, ...] = ()
        self._extracted: tuple[tuple[str, str], ...] | None = None
        self._runnable: set[str] = set()
        self._tried: dict[str, Document] = {}
        self._lab_findings: dict[str, tuple[Diagnostic, ...]] = {}
        self._server = ScriptServer()
        self._printed: str | None = None
        self._failure: BaseException | None = None

    def notice(self) -> None:
        """Say that more than a document changed."""
        with self._live.changed:
            self._everything = True
            self._live.changed.notify_all()

    def close(self) -> None:
        """End the process of scripts."""
        self._server.close()

    def fail(self, error: BaseException) -> None:
        """End `follow` by an exception of another thread."""
        with self._live.changed:
            self._failure = error
            self._live.changed.notify_all()

    def follow(self) -> None:
        """Work as long as the process lives."""
        while True:
            self._wait()
            try:
                with project_lock(self._options.root, self._said.say):
                    self.once()
            except _SupersededError:
                continue
            except EffectError as error:
                text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
                print(text, file=sys.stderr, flush=True)
                self._done(text)

    def _wait(self) -> None:
        """Until there is something to do, and nobody is saving."""
        live = self._live
        with live.changed:
            live.changed.wait_for(
                lambda: live.edits != self._seen or self._everything or self._failure is not None
            )
            if self._failure is not None:
                raise self._failure
            began = time.monotonic()
            while time.monotonic() < began + LONGEST:
                edits = live.edits
                live.changed.wait_for(lambda edits=edits: live.edits != edits, QUIET)  # type: ignore[misc]
                if live.edits == edits:
                    return

    def once(self) -> None:
        """Everything, now, as far as nothing is saved meanwhile."""
        live = self._live
        if live.due or self._everything:
            live.reread()
        with live.changed:
            self._seen, course = live.edits, live.course
            everything, self._everything = self._everything, False
        if course is None or live.library is None:
            self._done()
            return
        try:
            self._busy("looking at the whole course")
            live.behind["course"] = tuple(no_lessons(course))
            self._models(course, everything)
            self._draw(_FEW)
            self._scripts(course, everything)
            self._labs(course, everything)
            self._formulas(course)
            self._draw(None)
        except BaseException:
            with live.changed:
                self._everything |= everything
            raise
        self._done()

    def _check(self) -> None:
        self._live.calm.wait(LONGEST)
        if self._live.edits != self._seen or self._everything:
            raise _SupersededError

    def _busy(self, what: str) -> None:
        self._check()
        if self._live.busy != what:
            self._live.busy = what
            self._live.tell()

    def _done(self, trouble: str = "") -> None:
        """All is known: say what is wrong, if it is news."""
        live = self._live
        live.busy = ""
        live.trouble = trouble
        live.tell()
        report = report_now(live)
        text = render_report(report, "text", Style())
        if text == self._printed or trouble:
            return
        self._printed = text
        if report.diagnostics:
            print(text, file=sys.stderr, flush=True)
        else:
            self._said.say(f"checked: {text.strip().rpartition(': ')[2]}")

    # --- models

    def _models(self, course: Course, everything: bool) -> None:
        texts = (d for d in course.documents if self._live.parts.has_models(d))
        made_from = (course.models, *texts)
        same = len(made_from) == len(self._compiled) and all(
            a is b for a, b in zip(made_from, self._compiled, strict=True)
        )
        if same and not everything:
            return
        self._busy("compiling models")
        models, found = compile_models(course, self._options, self._progress)
        self._compiled = made_from
        self._live.behind["models"] = found
        self._live.take_models(models)

    # --- scripts

    def _scripts(self, course: Course, everything: bool) -> None:
        live = self._live
        listed = tuple(
            (path, script.code.text)
            for path, (script, _) in (live.library.scripts if live.library else {}).items()
        )
        if listed != self._extracted or everything:
            self._busy("running scripts")
            extracted = extract_scripts(course, self._options)
            live.behind["extract"] = extracted.diagnostics
            self._runnable = {extraction.path for extraction in extracted.runnable}
            left = {e.path for e in extracted.all} - {e.path for e in extracted.runnable}
            live.take_runs((), forget=left)
            everything |= self._extracted is not None
            self._extracted = listed
        runnable = self._extractions()
        fresh = [e for e in runnable if self._current(e) is None]
        for batch in _batches(fresh):
            self._run(batch)
        if everything and len(fresh) < len(runnable):
            # Those that lean on a file or a script that changed run again, the others are known.
            self._run([e for e in runnable if e not in fresh])
        self._verdicts(course, runnable)

    def _extractions(self) -> list[Extraction]:
        """The scripts that may run, as they stand now."""
        library = self._live.library
        scripts = {} if library is None else library.scripts
        return [
            extraction(script, owner)
            for path, (script, owner) in scripts.items()
            if path in self._runnable
        ]

    def _current(self, now: Extraction) -> ScriptRun | None:
        ran = self._live.parts.runs.get(now.path)
        same = ran is not None and (ran.text, (ran.job,)) == (now.text, jobs([now]))
        return ran.run if same and ran is not None else None

    def _run(self, batch: Sequence[Extraction], *, again: bool = False) -> None:
        """Run scripts, as far as their results are not remembered, and take what they did."""
        self._busy("running scripts again" if again else "running scripts")
        options = self._options
        memory = Memory(options.root, options.store, fresh=True) if again else None
        stage = "running scripts again" if again else "running scripts"
        run_all = functools.partial(self._server.run, unwanted=self._unwanted(batch))
        try:
            runs = run(batch, options, self._progress, stage, memory, run_all)
        except RunStoppedError:
            raise _SupersededError from None
        taken: list[Ran] = []
        for ran, done in zip(batch, runs, strict=True):
            new = Ran(jobs([ran])[0], ran.text, done)
            old = self._live.parts.runs.get(ran.path)
            if again and old is not None:
                printed = done.stdout if done.outcome is Outcome.OK else ""
                taken.append(dataclasses.replace(old, again=printed))
            elif old is None or not _same_run(old, new):
                taken.append(new)
        self._live.take_runs(taken)

    def _unwanted(self, batch: Sequence[Extraction]) -> Callable[[frozenset[str]], bool]:
        """Whether a script that runs is another by now, so that nobody waits for its output."""
        begun = {extraction.path: (extraction.text, jobs([extraction])) for extraction in batch}
        edits = self._seen

        def unwanted(running: frozenset[str]) -> bool:
            nonlocal edits
            with self._live.changed:
                if self._live.edits == edits:
                    return False
                edits = self._live.edits
                now = {e.path: (e.text, jobs([e])) for e in self._extractions()}
            return any(begun[path] != now.get(path) for path in running)

        return unwanted

    def _verdicts(self, course: Course, runnable: Sequence[Extraction]) -> None:
        """What running the scripts shows to be wrong."""
        live = self._live
        with live.changed:
            runs = live.parts.current(course)
            verdicts = live.parts.verdicts(course, runs)
        chosen = [e for e in runnable if e.path in runs]
        found = script_findings(course, chosen, tuple(runs.values()), verdicts)
        live.behind["scripts"] = (*found, *check_output_lines(course, runs.values()))
        live.tell()
        drifted = {verdict.recording.script for verdict in verdicts if verdict.status == "drift"}
        once = {path for path, ran in live.parts.runs.items() if ran.again is None}
        unsure = [e for e in runnable if e.path in drifted & once]
        for batch in _batches(unsure):
            self._run(batch, again=True)

    # --- labs

    def _labs(self, course: Course, everything: bool) -> None:
        live = self._live
        documents = {d.source.path: d for d in course.documents if live.parts.has_labs(d)}
        changed = {
            path
            for path, document in documents.items()
            if everything or self._tried.get(path) is not document
        }
        gone = self._tried.keys() - documents.keys()
        if not changed and not gone:
            return
        models: Mapping[str, CompileResult] = dict(live.parts.models)
        wrong = live.behind.get("models", ())
        results: tuple[LabResult, ...] = ()
        found: tuple[Diagnostic, ...] = ()
        if changed:
            self._busy("trying labs")
            engines = Engines(self._options.root)
            with self._progress.stage("trying labs"):
                results, found = try_labs(
                    course, models, self._options, engines, frozenset(changed), wrong, static=True
                )
        told = {path: tuple(d for d in found if d.span.path == path) for path in changed}
        known = self._lab_findings | told
        self._lab_findings = {path: d for path, d in known.items() if path in documents}
        live.behind["labs"] = tuple(d for some in self._lab_findings.values() for d in some)
        self._tried = {p: d for p, d in self._tried.items() if p in documents} | {
            path: documents[path] for path in changed
        }
        new = {lab.name: lab for lab in results}
        old = {lab.name: lab for lab in live.parts.labs if lab.span.path not in changed}
        order = [name for _, name, _ in labs_of(course)]
        live.take_labs(tuple((old | new)[name] for name in order if name in old | new))

    # --- formulas and pages

    def _formulas(self, course: Course) -> None:
        """Typeset what no page has asked for yet."""
        live = self._live
        waiting = live.parts.untypeset(course)
        with self._stage("typesetting formulas", waiting):
            for document in waiting:
                self._busy("typesetting formulas")
                with live.changed:
                    live.parts.typeset([document])
        with live.changed:
            live.parts.forget_formulas(course)

    def _draw(self, most: int | None) -> None:
        """Draw what is stale, and cut the fonts anew where that changes what they need.

        Nothing, where there is more than `most` to draw.
        """
        live = self._live
        with live.changed:
            todo = dict.fromkeys((*live.pages.waiting(), *live.pages.unnoted()))
        if most is not None and len(todo) > most:
            return
        with self._stage("drawing", todo):
            for path in todo:
                self._busy("drawing pages")
                with live.changed:
                    live.pages.look_at(path)
        with live.changed:
            facts = live.pages.needed()
        if facts is None:
            return
        self._busy("cutting fonts")
        files, names = live.pages.make_shared(facts)
        with live.changed:
            live.pages.share(facts, files, names)
            live.tell()

    def _stage(self, name: str, todo: Iterable[object]) -> contextlib.AbstractContextManager[None]:
        """Said only where it takes a while."""
        return self._progress.stage(name) if len(list(todo)) > _FEW else contextlib.nullcontext()


def _batches(extractions: Sequence[Extraction]) -> Iterable[Sequence[Extraction]]:
    return (extractions[at : at + _BATCH] for at in range(0, len(extractions), _BATCH))


def _same_run(one: Ran, two: Ran) -> bool:
    """Whether nothing that a page or a report may show is another."""
    a, b = one.run, two.run
    return (one.job, one.text) == (two.job, two.text) and (
        (a.outcome, a.status, a.stdout, a.stderr, a.missing)
        == (b.outcome, b.status, b.stdout, b.stderr, b.missing)
    )
