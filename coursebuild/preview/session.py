"""A course in memory that follows its files, and its site as it is now.

Entry point: `Session`.

1. `edit(paths)` takes saves of documents: these are read and checked, and nothing else is.
2. `read()` reads everything, for all other changes, and to be sure.
3. `take_results` brings what running the course found, `make_site` all files of its site.
4. `find(path)` gives a file.

`changed` is the lock of all that is here; who waits for news waits on it.
"""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.core.checks.course import check_document
from coursebuild.core.checks.links import LinkTargets, link_targets
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.features import PublishedTrials
from coursebuild.core.files.read import read_sources
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.model import Course, Document, Lesson, Owner, Page
from coursebuild.core.model.results import Outcome, Results, ScriptJob, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.templates import TemplateFailure
from coursebuild.core.registry import publish_trials
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.core.scripts.compare import verify as compare
from coursebuild.core.scripts.extract import extract, jobs
from coursebuild.core.scripts.source_parts import shown_files
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import MAP, load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.theme import template_diagnostic
from coursebuild.pipeline.verify import Verified
from coursebuild.preview.files import Files

ScriptKey: TypeAlias = tuple[str, ScriptJob]
"""The text of a script, and how it is run."""
MOST = 8
"""Documents saved at once that are taken one by one; more are read with the whole course."""
_GARBAGE = 200_000
"""Objects after which those in cycles are looked for: a session lives long."""
_SWITCH = 0.001
"""Seconds after which a thread that computes lets another one: an edit should not wait for long."""


class Session:
    """See the module."""

    def __init__(self, options: Options, *, site: bool = True) -> None:
        """`site`: whether pages are drawn."""
        self.options, self.root = options, options.root
        self.open_texts: Mapping[str, str] = {}
        """The texts of files that are open in an editor, which need not be saved, by path; another
        mapping with each change."""
        self.changed = threading.Condition(threading.RLock())
        self.version = 0
        """Grows with each change of what an open page may show."""
        self.edits = 0
        """Grows with each save."""
        self.calm = threading.Event()
        """Set as long as nobody is saving: background work makes room for a save."""
        self.calm.set()
        self.busy = "reading the course"
        """What is being done in the background, in words; empty when all is done."""
        self.trouble = ""
        """Why background work could not be done, if it could not."""
        self._is_map_broken = False
        self.library: Library | None = None
        """What is known of the course, for drawing; `None` before a map could be read."""
        self.verified: Course | None = None
        """The course that was run last."""
        self.found_by_running: tuple[Diagnostic, ...] = ()
        self.all_due = True
        """Whether any script may print something new: files other than documents have changed."""
        self._documents = Documents(options.store, 1)
        self._reading = threading.Lock()
        """Held while documents are read: `Documents` knows one text of each."""
        self._assets = Assets(template_texts(), Bundle(), prepared_folder())
        self._static: dict[str, tuple[Diagnostic, ...]] = {}
        """What reading and checking found, by file."""
        self._failed: tuple[Diagnostic, ...] = ()
        """That a template of the course failed when a page was drawn."""
        self._targets: LinkTargets | None = None
        self._results = Results((), (), (), (), python_version(), engine_version())
        self._reports = Reports()
        self._ran: dict[str, ScriptKey] = {}
        """The scripts that were run, as they were then."""
        self._again: dict[str, tuple[tuple[ScriptKey, str], str]] = {}
        """Of scripts that ran twice: what was run and what it printed, and then what it printed."""
        self._trials = PublishedTrials()
        self.files = Files(options, self._assets, self._documents, self._is_sound)
        self._site = site

    def start(self, progress: Progress) -> None:
        """Read the course on all cores, while this process has no threads and can be copied."""
        options = self.options
        with Documents(options.store, options.jobs, progress.stage) as documents:
            self.read(documents)
        sys.setswitchinterval(_SWITCH)
        gc.freeze()  # what is read lives as long as the process: nobody need look through it again
        gc.set_threshold(_GARBAGE, 50, 50)

    def close(self) -> None:
        """End what typesets formulas: with it running, the process may hang as it ends."""
        with self.changed:
            self._documents.close()

    # --- what is known

    @property
    def course(self) -> Course | None:
        """The course as it was last read; `None` before a map could be read."""
        return None if self.library is None else self.library.course

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that is known to be wrong."""
        with self.changed:
            return (*self.found_by_reading, *self.found_by_running, *self._failed)

    @property
    def found_by_reading(self) -> tuple[Diagnostic, ...]:
        """What reading and checking found."""
        with self.changed:
            return tuple(d for found in self._static.values() for d in found)

    def blocking(self, path: str) -> list[Diagnostic]:
        """What keeps the page at a site path as it was: mistakes in its text or in the map."""
        document = self.files.document(path)
        own = [] if document is None else self._static.get(document.source.path, ())
        map_ = self._static.get(MAP, ()) if self._is_map_broken else ()
        return [d for d in (*own, *map_) if d.is_error]

    def files_elsewhere(self) -> frozenset[str]:
        """The files of lessons and pages, and what they show of others."""
        course = self.course
        if course is None:
            return frozenset()
        return shown_files(course) | {one.path for one in course.owners}

    def packages(self) -> frozenset[str]:
        """The folders that scripts import from."""
        return frozenset(one.path for one in self.course.packages) if self.course else frozenset()

    def base(self) -> str:
        """The path under which the published site will be, with a slash at both ends."""
        return "/" if self.course is None else urls.base_path(self.course)

    def tell(self, *, saved: bool = False) -> None:
        """Say that there is news; `saved`: of files, from which all else follows."""
        with self.changed:
            if saved:
                self.edits += 1
                self.busy = self.busy or "checking"
            self.version += 1
            self.changed.notify_all()

    # --- the course

    def edit(self, paths: Collection[str], *, saved: bool = True) -> bool | None:
        """Take saves of documents; whether anything has changed.

        `None` where everything must be read to know. If not `saved`, they are being typed, and
        nothing runs yet.
        """
        with self._reading, self.changed:
            course, fresh = self.course, self._saved(paths)
            if fresh is None or course is None:
                return None
            if not fresh:
                if saved and not self.open_texts.keys().isdisjoint(paths):
                    self.tell(saved=True)  # its scripts may run
                return False
            self._show(_with_owners(course, [owner for owner, _ in fresh]))
            for owner, found in fresh:
                assert owner.document is not None
                self._static[owner.path] = (*found, *self._check(owner.document))
            self.tell(saved=saved)
            for owner, _ in fresh if self._site else ():
                self.find(urls.owner_path(owner))
            return True

    def _saved(self, paths: Collection[str]) -> list[tuple[Owner, tuple[Diagnostic, ...]]] | None:
        """The lessons and pages whose text has changed, and what is wrong in it by itself."""
        if self.library is None or len(paths) > MOST:
            return None
        course = self.library.course
        known = {owner.path: owner for owner in course.owners}
        fresh: list[tuple[Owner, tuple[Diagnostic, ...]]] = []
        for path in sorted(paths):
            owner = known.get(path)
            read = read_sources(self.root, [path], self.open_texts)
            sources = [one for one in read.value if len(one.text) <= course.limits.text]
            if owner is None or owner.document is None or not sources:
                return None
            (source,) = sources
            if source != owner.document.source or self._static.get(path):
                callouts, lesson = frozenset(self.library.callouts), isinstance(owner, Lesson)
                parsed = self._documents.document(source, callouts, lesson=lesson)
                found = (*read.diagnostics, *parsed.diagnostics)
                fresh.append((replace(owner, document=parsed.value), found))
        return fresh

    def _check(self, document: Document) -> tuple[Diagnostic, ...]:
        """What is wrong in a document, given the others."""
        assert self.course is not None and self._targets is not None
        return check_document(self.course, document, self._targets)

    def take_others(self) -> None:
        """Take saves of other files."""
        with self.changed:
            self.all_due = True
            self.tell(saved=True)
        self.read()

    def read(self, documents: Documents | None = None, *, saved: bool = True) -> bool:
        """Read the whole course; whether anything has changed.

        `saved`: see `edit`.
        """
        documents = documents or self._documents
        while True:
            edits = self.edits
            with self._reading:
                loaded = load(self.root, documents, self.open_texts)
                course = loaded.value
                reports = Parsed(Reports(), ())
                if course is not None:
                    reports = shown_reports(self.root, course)
                with self.changed:
                    if edits != self.edits:
                        continue
                    found = (*loaded.diagnostics, *reports.diagnostics)
                    fresh = self._take_course(course, found, reports.value)
                    if fresh:
                        self.tell(saved=saved)
                    return fresh

    def saved_course(self) -> Course | None:
        """The course as it is on the disk, whose scripts are run."""
        texts = self.open_texts
        with self._reading:
            saved = read_sources(self.root, sorted(texts)).value
            if all(source.text == texts[source.path] for source in saved):
                return self.course
            return load(self.root, self._documents).value

    def _take_course(
        self, course: Course | None, diagnostics: Iterable[Diagnostic], reports: Reports
    ) -> bool:
        found: dict[str, tuple[Diagnostic, ...]] = {}
        for diagnostic in diagnostics:
            path = diagnostic.span.path
            found[path] = (*found.get(path, ()), diagnostic)
        same = found == {path: told for path, told in self._static.items() if told}
        self._is_map_broken = course is None
        self._static = found
        if course is not None:
            same = same and reports == self._reports and course == self.course
            self._reports = reports
            self._show(course)
        return not same

    def _show(self, course: Course) -> None:
        """Draw pages of this course from now on, with what is known of it."""
        same = dict(self._ran.items() & script_keys(course).items())
        runs = tuple(run for run in self._results.runs if run.path in same)
        results = replace(self._results, runs=runs, verdicts=compare(course, runs))
        self._failed = ()
        self.library = Library.of(course, results, self._assets, self._reports, trials=self._trials)
        self._targets = link_targets(course)
        if self._site:
            self.files.show(self.library)

    # --- what background work found

    def take_results(self, course: Course, verified: Verified) -> None:
        """Take what verifying a course found."""
        results, trials = verified.results, self._trials
        if results.trials != self._results.trials:
            trials = publish_trials(results, self._assets)
        with self.changed:
            self.verified, self.found_by_running = course, verified.diagnostics
            self._results, self._trials = results, trials
            self._ran = script_keys(course)
            if self.course is not None:
                self._show(self.course)
            self.tell()

    def take_run(self, script: ScriptKey, run: ScriptRun) -> None:
        """Show what one script did, while others run."""
        with self.changed:
            others = (other for other in self._results.runs if other.path != run.path)
            self._results = replace(self._results, runs=(*others, run))
            self._ran[run.path] = script
            if self.course is not None:
                self._show(self.course)
            self.tell()

    def drifted(self, runs: Sequence[ScriptRun]) -> set[str]:
        """The scripts of these that print something else than is recorded."""
        with self.changed:
            verdicts = () if self.course is None else compare(self.course, runs)
        return {v.recording.script or "" for v in verdicts if v.status == "drift"}

    def known_runs(self, course: Course) -> dict[str, ScriptRun]:
        """What a course's scripts did, by path; nothing where one has changed since."""
        with self.changed:
            same = script_keys(course) == self._ran
            return {run.path: run for run in self._results.runs} if same else {}

    def take_second_runs(self, runs: Iterable[ScriptRun]) -> None:
        """Take what scripts printed that ran once more."""
        first = {run.path: run for run in self._results.runs}
        with self.changed:
            for run in runs:
                printed = run.stdout if run.outcome is Outcome.OK else ""
                self._again[run.path] = (self._ran[run.path], first[run.path].stdout), printed
            self.tell()

    def printed_again(self, path: str) -> str | None:
        """What a script printed when it ran once more with the same text, if it did."""
        first, printed = self._again.get(path, (None, ""))
        run = next((run for run in self._results.runs if run.path == path), None)
        same = run is not None and first == (self._ran.get(path), run.stdout)
        return printed if same else None

    def make_site(self, pause: Callable[[], None]) -> None:
        """Put all files of the site together, and serve them; `pause` is called between pages."""
        if not self._site:
            return
        with self.changed:
            library = self.library
            assert library is not None
            wrong = {path for path, found in self._static.items() if has_errors(found)}
            broken = {urls.owner_path(o) for o in library.course.owners if o.path in wrong}
        try:
            site = self.files.make(library, broken, pause)
        except TemplateFailure as failure:
            self._fail(failure)
            return
        with self.changed:
            self.files.serve(site)
            self.tell()

    # --- files

    def find(self, path: str) -> bytes | None:
        """A file of the site, if there is one and it can be had."""
        with self.changed:
            try:
                return self.files.find(path)
            except TemplateFailure as failure:
                self._fail(failure)
                return None

    def _fail(self, failure: TemplateFailure) -> None:
        """Tell that a template of the course fails."""
        with self.changed:
            assert self.course is not None
            found = (template_diagnostic(self.course, failure),)
            if found != self._failed:
                self._failed = found
                self.tell()

    def _is_sound(self, document: Document) -> bool:
        """Whether nothing is wrong in a document, which can be drawn then."""
        known = self._static.get(document.source.path, ())
        return not has_errors(known) and not has_errors(self._check(document))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether anything is wrong; warnings do not count."""
    return any(d.is_error for d in diagnostics)


def script_keys(course: Course) -> dict[str, ScriptKey]:
    """What the scripts of a course are run by: those with the same key print the same."""
    scripts = extract(course).value
    return {job.path: (e.text, job) for e, job in zip(scripts, jobs(scripts), strict=True)}


def _with_owners(course: Course, fresh: Iterable[Owner]) -> Course:
    """The course with other lessons and pages in the places of those with their ids."""
    lessons = {owner.id: owner for owner in fresh if isinstance(owner, Lesson)}
    pages = {owner.id: owner for owner in fresh if isinstance(owner, Page)}
    levels = tuple(
        replace(level, lessons=tuple(lessons.get(old.id, old) for old in level.lessons))
        for level in course.levels
    )
    return replace(course, levels=levels, pages=tuple(pages.get(p.id, p) for p in course.pages))
