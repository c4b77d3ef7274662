"""A course in memory that follows its files, and its site as it is now.

Entry point: `Session`.

1. `edit(paths)` takes saves of documents: these are read and checked, and nothing else is.
2. `read()` reads everything, for all other changes, and to be sure.
3. `take_results` brings what running the course found, `make_site` all files of its site.
4. `find(path)` gives a file.

`changed` is the lock of all that is here; who waits for news waits on it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Generic, TypeVar

from msgspec.structs import replace

from coursebuild.core.checks.course import check_document
from coursebuild.core.checks.links import LinkTargets, link_targets
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.features import PublishedTrials
from coursebuild.core.files.read import read_sources
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.model import Course, Document, Lesson, Page
from coursebuild.core.model.results import Outcome, Results, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.library import Library, Owner, named_models, owners
from coursebuild.core.pages.templates import TemplateFailure
from coursebuild.core.registry import publish_trials
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.core.scripts.compare import verify as compare
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from coursebuild.core.scripts.source_parts import shown_files
from coursebuild.core.text.diagnostics import Diagnostic, Severity
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import MAP, Loaded, load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.theme import template_diagnostic
from coursebuild.pipeline.verify import Verified
from coursebuild.preview.files import Files

T = TypeVar("T")

MOST = 8
"""Documents saved at once that are taken one by one; more are read with the whole course."""


class PerDocument(Generic[T]):
    """A function of a document, which is not called again for the very same one."""

    def __init__(self, make: Callable[[Document], T]) -> None:
        self._make = make
        self._known: dict[str, tuple[Document, T]] = {}

    def __call__(self, document: Document) -> T:
        """The result for a document."""
        path = document.source.path
        known = self._known.get(path)
        if known is None or known[0] is not document:
            known = self._known[path] = document, self._make(document)
        return known[1]


class Session:
    """See the module."""

    def __init__(self, options: Options, *, site: bool = True) -> None:
        """`site`: whether pages are drawn."""
        self.root = options.root
        self.open_texts: Mapping[str, str] = {}
        """The texts of files that are open in an editor, which need not be saved, by path; another
        mapping with each change."""
        self.changed = threading.Condition(threading.RLock())
        self.version = 0
        """Grows with everything that an open page may show."""
        self.edits = 0
        """Grows with everything that an author did."""
        self.calm = threading.Event()
        """Set as long as nobody is saving: background work makes room for a save."""
        self.calm.set()
        self.busy = "reading the course"
        """What is still done in the background, in words; empty where everything is known."""
        self.trouble = ""
        """Why background work could not be done, if it could not."""
        self._is_map_broken = False
        self.course: Course | None = None
        self.library: Library | None = None
        """What is known of the course, for drawing; `None` before a map could be read."""
        self.verified: Course | None = None
        """The course that was run last."""
        self.found_by_running: tuple[Diagnostic, ...] = ()
        self.all_due = True
        """Whether more changed than documents, so that any script may do something else now."""
        self._documents = Documents(options.store, 1)
        self._reading = threading.Lock()
        """Held while documents are read: `Documents` knows one text of each."""
        self._assets = Assets(template_texts(), Bundle(), prepared_folder())
        self._models_of = PerDocument(named_models)
        self._static: dict[str, tuple[Diagnostic, ...]] = {}
        """What reading and checking found, by file."""
        self._failed: tuple[Diagnostic, ...] = ()
        """That a template of the course failed when a page was drawn."""
        self._targets: LinkTargets | None = None
        self._site_paths: dict[str, str] = {}
        """The site paths of lessons and pages, by the path of their file."""
        self._results = Results((), (), (), (), python_version(), engine_version())
        self._reports = Reports()
        self._ran: dict[str, Extraction] = {}
        """The scripts that were run, as they were then."""
        self._again: dict[str, tuple[Extraction, str, str]] = {}
        """Of scripts that ran twice: what was run, and what each run printed."""
        self._trials = PublishedTrials()
        self.files = Files(options, self._assets, self._documents, self._is_sound)
        self._site = site

    def start(self, options: Options, progress: Progress) -> None:
        """Read the course on all cores, while this process has no threads and can be copied."""
        with Documents(options.store, options.jobs, progress.stage) as documents:
            self.read(documents)

    def close(self) -> None:
        """End what typesets formulas: a process that ends with it running may hang."""
        with self.changed:
            self._documents.close()

    # --- what may be asked

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
        return [d for d in (*own, *map_) if d.severity is Severity.ERROR]

    def files_elsewhere(self) -> frozenset[str]:
        """The files of lessons and pages, and what they show of others."""
        course = self.course
        if course is None:
            return frozenset()
        return shown_files(course) | {one.path for one in owners(course)}

    def base(self) -> str:
        """The path under which the published site will be, with a slash at both ends."""
        return "/" if self.course is None else urls.base_path(self.course)

    def tell(self) -> None:
        """Say that there is news."""
        with self.changed:
            self.version += 1
            self.changed.notify_all()

    def touch(self) -> None:
        """Note that something was saved, whatever it comes to."""
        with self.changed:
            self.edits += 1
            self.busy = self.busy or "checking"
            self.tell()

    def _tell_of(self, *, saved: bool) -> None:
        if saved:
            self.touch()
        else:
            self.tell()

    # --- the course

    def edit(self, paths: Collection[str], *, saved: bool = True) -> bool | None:
        """Take saves of documents; whether anything is another now.

        `None` where only reading everything tells. `saved`: if not, they are being typed, and
        nothing runs yet.
        """
        with self._reading, self.changed:
            course, fresh = self.course, self._saved(paths)
            if fresh is None or course is None:
                return None
            if not fresh:
                if saved and not self.open_texts.keys().isdisjoint(paths):
                    self.touch()  # its scripts may run
                return False
            self._show(_with_owners(course, [owner for owner, _ in fresh]))
            for owner, found in fresh:
                assert owner.document is not None
                self._static[owner.path] = (*found, *self._check(owner.document))
            self._tell_of(saved=saved)
            for owner, _ in fresh if self._site else ():
                self.find(self._site_paths[owner.path])
            return True

    def _saved(self, paths: Collection[str]) -> list[tuple[Owner, tuple[Diagnostic, ...]]] | None:
        """The lessons and pages whose text is another now, and what is wrong in it by itself."""
        if self.course is None or len(paths) > MOST:
            return None
        known = {owner.path: owner for owner in owners(self.course)}
        fresh: list[tuple[Owner, tuple[Diagnostic, ...]]] = []
        for path in sorted(paths):
            owner = known.get(path)
            read = read_sources(self.root, [path], self.open_texts)
            sources = [one for one in read.value if len(one.text) <= self.course.limits.text]
            if owner is None or owner.document is None or not sources:
                return None
            (source,) = sources
            if source != owner.document.source or self._static.get(path):
                callouts, lesson = _callouts(self.course), isinstance(owner, Lesson)
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
            self.touch()
        self.read()

    def read(self, documents: Documents | None = None, *, saved: bool = True) -> bool:
        """Read the whole course; whether anything is another than it was thought to be.

        `saved`: see `edit`.
        """
        documents = documents or self._documents
        while True:
            edits = self.edits
            with self._reading:
                loaded = load(self.root, documents, self.open_texts)
                course = loaded.course
                reports = None if course is None else shown_reports(self.root, course)
                with self.changed:
                    if edits != self.edits:
                        continue
                    found = loaded.diagnostics + (reports.diagnostics if reports else ())
                    fresh = self._take_course(loaded, found, reports.value if reports else None)
                    if fresh:
                        self._tell_of(saved=saved)
                    return fresh

    def saved_course(self) -> Course | None:
        """The course as it is on the disk, of which scripts run."""
        texts = self.open_texts
        with self._reading:
            saved = read_sources(self.root, sorted(texts)).value
            if all(source.text == texts[source.path] for source in saved):
                return self.course
            return load(self.root, self._documents).course

    def _take_course(
        self, loaded: Loaded, diagnostics: Iterable[Diagnostic], reports: Reports | None
    ) -> bool:
        found: dict[str, tuple[Diagnostic, ...]] = {}
        for diagnostic in diagnostics:
            path = diagnostic.span.path
            found[path] = (*found.get(path, ()), diagnostic)
        same = found == {path: told for path, told in self._static.items() if told}
        self._is_map_broken = loaded.course is None
        self._static = found
        if loaded.course is not None:
            same = same and reports == self._reports and _is_same(self.course, loaded.course)
            self._reports = reports or Reports()
            self._show(loaded.course)
        return not same

    def _show(self, course: Course) -> None:
        """Draw pages of this course from now on, with what is known of it."""
        scripts = {extraction.path: extraction for extraction in extract(course).value}
        runs = tuple(
            run
            for run in self._results.runs
            if is_same_script(self._ran.get(run.path), scripts.get(run.path))
        )
        results = replace(self._results, runs=runs, verdicts=compare(course, runs))
        self._failed = ()
        self.course = course
        self.library = library = Library.of(
            course,
            results,
            self._assets,
            self._reports,
            trials=self._trials,
            models_of=self._models_of,
        )
        self._targets = link_targets(course)
        self._site_paths = {
            **{entry.path: urls.lesson_path(entry) for entry in course.lessons},
            **{page.path: urls.page_path(page) for page in course.pages},
        }
        if self._site:
            self.files.show(library)

    # --- what background work found

    def take_results(self, course: Course, verified: Verified) -> None:
        """Take what verifying a course found."""
        results, trials = verified.results, self._trials
        if results.trials != self._results.trials:
            trials = publish_trials(results, self._assets)
        with self.changed:
            self.verified, self.found_by_running = course, verified.diagnostics
            self._results, self._trials = results, trials
            self._ran = {extraction.path: extraction for extraction in extract(course).value}
            if self.course is not None:
                self._show(self.course)
            self.tell()

    def take_run(self, script: Extraction, run: ScriptRun) -> None:
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

    def known_runs(self, scripts: Iterable[Extraction]) -> dict[str, ScriptRun]:
        """What these scripts did, by path; nothing where one of them is another than it was."""
        now = {script.path: script for script in scripts}
        with self.changed:
            same = now.keys() == self._ran.keys() and all(
                is_same_script(script, self._ran[path]) for path, script in now.items()
            )
            return {run.path: run for run in self._results.runs} if same else {}

    def take_second_runs(self, runs: Iterable[ScriptRun]) -> None:
        """Take what scripts printed that ran once more."""
        first = {run.path: run for run in self._results.runs}
        with self.changed:
            for run in runs:
                printed = run.stdout if run.outcome is Outcome.OK else ""
                self._again[run.path] = self._ran[run.path], first[run.path].stdout, printed
            self.tell()

    def printed_again(self, path: str) -> str | None:
        """What a script printed when it ran once more with the same text, if it did."""
        script, first, printed = self._again.get(path, (None, "", ""))
        now = next((run for run in self._results.runs if run.path == path), None)
        same = now is not None and now.stdout == first
        return printed if same and is_same_script(script, self._ran.get(path)) else None

    def make_site(self, pause: Callable[[], None]) -> None:
        """Put all files of the site together, and serve them; `pause` is called between pages."""
        if not self._site:
            return
        with self.changed:
            library = self.library
            wrong = {path for path, found in self._static.items() if has_errors(found)}
            broken = {site for path, site in self._site_paths.items() if path in wrong}
        assert library is not None
        try:
            serve = self.files.make(library, broken, pause)
        except TemplateFailure as failure:
            self._fail(failure)
            return
        with self.changed:
            serve()
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
    return any(d.severity is Severity.ERROR for d in diagnostics)


def is_same_script(one: Extraction | None, two: Extraction | None) -> bool:
    """Whether two scripts are run alike and print the same."""
    if one is None or two is None:
        return False
    return one.text == two.text and jobs([one]) == jobs([two])


def _callouts(course: Course) -> frozenset[str]:
    return frozenset(kind.name for kind in course.callouts)


def _with_owners(course: Course, fresh: Iterable[Owner]) -> Course:
    """The course with other lessons and pages in the places of those with their ids."""
    lessons = {owner.id: owner for owner in fresh if isinstance(owner, Lesson)}
    pages = {owner.id: owner for owner in fresh if isinstance(owner, Page)}
    levels = tuple(
        replace(level, lessons=tuple(lessons.get(old.id, old) for old in level.lessons))
        for level in course.levels
    )
    return replace(course, levels=levels, pages=tuple(pages.get(p.id, p) for p in course.pages))


def _is_same(old: Course | None, new: Course) -> bool:
    """Whether two readings gave the same course."""
    return (
        old is not None
        and old.map.text == new.map.text
        and old.models == new.models
        and old.theme == new.theme
        and old.declarations == new.declarations
        and old.files == new.files
        and [d.source for d in old.documents] == [d.source for d in new.documents]
    )
