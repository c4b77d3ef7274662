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

A save in between begins this anew; what was found stays as far as it holds, and a stage that has
looked at everything is not asked to once more. A script that runs is ended only where it is another
by now: the others go on.
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator, Mapping

from coursebuild.diagnostics import Diagnostic
from coursebuild.effects.errors import EffectError
from coursebuild.effects.locks import project_lock
from coursebuild.model import Course, Document
from coursebuild.pipeline.check import no_lessons
from coursebuild.pipeline.labs import Engines, labs_of, try_labs
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.preview.scripts import Scripts, SupersededError
from coursebuild.pipeline.preview.told import report_now
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.verify import compile_models
from coursebuild.report import Style, render_report
from coursebuild.results import CompileResult, LabResult

QUIET = 0.15
"""Seconds without a save after which the slow work begins."""
LONGEST = 2.0
"""Seconds after which it begins all the same."""
_FEW = 12
"""So many pages may be drawn before the scripts run, so that new characters have their font."""
_RETRY = 2.0
"""Seconds after which what could not be done is tried again, though nothing was saved."""
_STAGES = frozenset({"reading", "models", "scripts", "labs"})
"""What leans on more than documents."""


class Behind:
    """See the module."""

    def __init__(self, live: LiveCourse, options: Options, progress: Progress) -> None:
        self._live = live
        self._options = options
        self._said = progress
        # Which scripts run is said on a terminal, where it is gone again when they are done.
        self._progress = progress if progress.live else Progress(quiet=True)
        self._seen = (-1, -1)
        """Of the state that was looked at last: the numbers of edits and of notices."""
        self._notices = 0
        """How often more changed than documents."""
        self._due = {"reading"}
        """The stages that are to look at everything, whatever documents changed. At first the
        others have seen nothing, and find all of it new."""
        self._compiled: tuple[object, ...] = ()
        self._scripts = Scripts(live, options, self._progress, self._busy)
        self._tried: dict[str, Document] = {}
        self._lab_findings: dict[str, tuple[Diagnostic, ...]] = {}
        self._printed: str | None = None
        self._failure: BaseException | None = None

    def notice(self) -> None:
        """Say that more than a document changed."""
        with self._live.changed:
            self._notices += 1
            self._due |= _STAGES
            self._live.changed.notify_all()

    def close(self) -> None:
        """End the process of scripts."""
        self._scripts.close()

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
            except SupersededError:
                continue
            except EffectError as error:
                text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
                if text != self._live.trouble:
                    print(text, file=sys.stderr, flush=True)
                self._done(text)

    def _wait(self) -> None:
        """Until there is something to do, and nobody is saving."""
        live = self._live
        with live.changed:
            live.changed.wait_for(
                lambda: self._now() != self._seen or self._failure is not None,
                _RETRY if live.trouble else None,
            )
            if self._failure is not None:
                raise self._failure
            began = time.monotonic()
            while time.monotonic() < began + LONGEST:
                edits = live.edits
                live.changed.wait_for(lambda edits=edits: live.edits != edits, QUIET)  # type: ignore[misc]
                if live.edits == edits:
                    return

    def _now(self) -> tuple[int, int]:
        """The number of the state that there is."""
        return self._live.edits, self._notices

    def once(self) -> None:
        """Everything, now, as far as nothing is saved meanwhile."""
        live = self._live
        with live.changed:
            self._seen = _, notices = self._now()
            if live.due:
                self._due.add("reading")
        with self._looking("reading") as everything:
            if everything:
                live.reread()
        with live.changed:
            self._seen, course = (live.edits, notices), live.course
        if course is None or live.library is None:
            self._done()
            return
        self._busy("looking at the whole course")
        live.behind["course"] = tuple(no_lessons(course))
        self._models(course)
        self._draw(_FEW)
        with self._looking("scripts") as everything:
            self._scripts.extract(course, everything)
        self._scripts.run(course)
        self._labs(course)
        self._formulas(course)
        self._draw(None)
        self._done()

    @contextlib.contextmanager
    def _looking(self, stage: str) -> Iterator[bool]:
        """Whether a stage is to look at everything; it still is where it comes to no end."""
        with self._live.changed:
            everything = stage in self._due
            self._due.discard(stage)
        try:
            yield everything
        except BaseException:
            if everything:
                with self._live.changed:
                    self._due.add(stage)
            raise

    def _check(self) -> None:
        self._live.calm.wait(LONGEST)
        if self._now() != self._seen:
            raise SupersededError

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

    def _models(self, course: Course) -> None:
        with self._looking("models") as everything:
            self._compile(course, everything)

    def _compile(self, course: Course, everything: bool) -> None:
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

    # --- labs

    def _labs(self, course: Course) -> None:
        with self._looking("labs") as everything:
            self._try(course, everything)

    def _try(self, course: Course, everything: bool) -> None:
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
                # In two steps: a save waits for no more than one of them.
                for step in (live.pages.prepare, live.pages.look_at):
                    self._busy("drawing pages")
                    with live.changed:
                        step(path)
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
