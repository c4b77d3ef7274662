"""A course in memory that follows its files, with its site as it is now.

`edit` takes saves of documents: only these are read and checked. `read` reads everything, after
other changes and to be sure. `condition` is the lock of everything here; whoever waits for news
waits on it.
"""

from __future__ import annotations

import gc
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Mapping

from msgspec.structs import replace

from coursebuild.core.checks.lessons import check_document
from coursebuild.core.checks.links import LinkTargets, link_targets
from coursebuild.core.files.read import read_sources
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Course, Document, Lesson, Owner, Page
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.model.results import Reports, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import Mistakes
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.renderer import TemplateFailure
from coursebuild.core.registry import publish_trials
from coursebuild.core.scripts.edit import shown_files
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source
from coursebuild.pipeline.load import Code, load
from coursebuild.pipeline.options import Options, Progress
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scenes import shown_reports
from coursebuild.pipeline.theme_files import template_diagnostic
from coursebuild.pipeline.verify import Verification
from coursebuild.preview.run_history import RunHistory, ScriptKey
from coursebuild.preview.site_files import Files

MAX_SINGLE_READS = 8
"""Documents saved at once that are read one by one; for more, the whole course is read."""
SHOWN_BY_RESULT = ("output-drift", "binding-mismatch", "figure-drift")
"""Rules whose mistakes a page shows with what was printed or drawn, where it is recorded."""
_GARBAGE = 200_000
"""Objects after which Python looks for cycles: a session lives long."""
_SWITCH = 0.001
"""Seconds after which Python lets another thread run: an edit should not wait for long."""


class Session:
    """A course in memory, with its site; see the module."""

    def __init__(self, options: Options, *, site: bool = True) -> None:
        """`site`: whether pages are drawn."""
        self.options, self.root = options, options.root
        self.open_texts: Mapping[str, str] = {}
        """The texts of files that are open in an editor, saved or not, by path. Each change
        replaces the mapping."""
        self.condition = threading.Condition(threading.RLock())
        self.version = 0
        """Grows with each change of what an open page may show."""
        self.edits = 0
        """Grows with each save."""
        self.code: Code = "run"
        """`known` until the user does something that may run the course's code."""
        self.calm = threading.Event()
        """Set while nobody is saving: background work waits for it."""
        self.calm.set()
        self.busy = "reading the course"
        """What is being done in the background, in words; empty when everything is done."""
        self.trouble = ""
        """Why background work could not be done, if it could not."""
        self.library: Library | None = None
        """The course with its results, for drawing; `None` before a map could be read."""
        self.runs = RunHistory()
        quiet_options = replace(options, jobs=1, progress=Progress(quiet=True))
        self.reader = Reader(quiet_options)
        self._reading_lock = threading.Lock()
        """Held while documents are read: a `Reader` has one text of each."""
        self._assets = Assets(template_texts(), Bundle(), prepared_folder())
        self._diagnostics_by_file: dict[str, tuple[Diagnostic, ...]] = {}
        """The diagnostics of reading and checking, by file."""
        self._template_diagnostics: tuple[Diagnostic, ...] = ()
        """The diagnostic of a template of the course that failed when a page was drawn."""
        self._targets: LinkTargets | None = None
        self._reports = Reports()
        self.files = Files(options, self._assets, self.reader, self.mistakes)
        self._site = site

    def run_code(self) -> None:
        """Run scripts and features from now on."""
        with self.condition:
            self.code = "run"
            self.notify(is_saved=True)

    def start(self) -> None:
        """Read the course on all cores, while this process has no threads and can be copied."""
        with Reader(self.options) as reader:
            self.read(reader)
        sys.setswitchinterval(_SWITCH)
        gc.freeze()  # what was read lives as long as the process: do not look through it again
        gc.set_threshold(_GARBAGE, 50, 50)

    def close(self) -> None:
        """End what typesets formulas: with it running, the process may hang at its end."""
        with self.condition:
            self.reader.close()

    # --- the state

    @property
    def course(self) -> Course | None:
        """The course as it was last read; `None` before a map could be read."""
        return None if self.library is None else self.library.course

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics."""
        with self.condition:
            return (
                *self.reading_diagnostics,
                *self.runs.diagnostics,
                *self.runs.noise,
                *self._template_diagnostics,
            )

    @property
    def reading_diagnostics(self) -> tuple[Diagnostic, ...]:
        """The diagnostics of reading and checking."""
        with self.condition:
            return tuple(
                d for diagnostics in self._diagnostics_by_file.values() for d in diagnostics
            )

    def mistakes(self, document: Document) -> Mistakes:
        """Where mistakes are marked when the page of a document is drawn.

        Without errors it is drawn as a build does, which then need not draw it again.
        """
        diagnostics = [d for d in self.diagnostics() if is_marked(d, document)]
        has_errors = any(d.is_error for d in diagnostics)
        return tuple(sorted({(d.span.start, d.is_error) for d in diagnostics if has_errors}))

    def files_elsewhere(self) -> frozenset[str]:
        """The files of lessons and pages, and other files of which they show parts."""
        course = self.course
        if course is None:
            return frozenset()
        return shown_files(course) | {owner.path for owner in course.owners}

    def packages(self) -> frozenset[str]:
        """The folders that scripts import from."""
        packages = self.course.packages if self.course else ()
        return frozenset(package.path for package in packages)

    def base(self) -> str:
        """The path under which the published site will be, with a slash at both ends."""
        return "/" if self.course is None else urls.base_path(self.course.base_url)

    def notify(self, *, is_saved: bool = False) -> None:
        """Say that there is news; `is_saved`: files were saved, so everything is checked again."""
        with self.condition:
            if is_saved:
                self.edits += 1
                self.busy = self.busy or "checking"
            self.version += 1
            self.condition.notify_all()

    # --- the course

    def edit(self, paths: Collection[str], *, is_saved: bool = True) -> bool | None:
        """Take saves of documents; return whether anything has changed.

        `None` where everything must be read to know. If not `is_saved`, they are being typed, and
        nothing runs yet.
        """
        with self._reading_lock, self.condition:
            course, changed_owners = self.course, self._read_changed(paths)
            if changed_owners is None or course is None:
                return None
            if not changed_owners:
                if is_saved and not self.open_texts.keys().isdisjoint(paths):
                    self.notify(is_saved=True)  # its scripts may run
                return False
            lessons = {owner.id: owner for owner, _ in changed_owners if isinstance(owner, Lesson)}
            pages = {owner.id: owner for owner, _ in changed_owners if isinstance(owner, Page)}
            levels = tuple(
                replace(level, lessons=tuple(lessons.get(old.id, old) for old in level.lessons))
                for level in course.levels
            )
            all_pages = tuple(pages.get(page.id, page) for page in course.pages)
            self._show(replace(course, levels=levels, pages=all_pages))
            for owner, diagnostics in changed_owners:
                assert owner.document is not None and self.course and self._targets
                mistakes = check_document(self.course, owner.document, self._targets)
                self._diagnostics_by_file[owner.path] = (*diagnostics, *mistakes)
            self.notify(is_saved=is_saved)
            for owner, _ in changed_owners if self._site else ():
                self.find(urls.owner_path(owner))
            return True

    def _read_changed(
        self, paths: Collection[str]
    ) -> list[tuple[Owner, tuple[Diagnostic, ...]]] | None:
        """Read the documents whose text has changed; return them with their own diagnostics.

        `None` where everything must be read.
        """
        if self.library is None or len(paths) > MAX_SINGLE_READS:
            return None
        course = self.library.course
        owners = {owner.path: owner for owner in course.owners}
        changed_owners: list[tuple[Owner, tuple[Diagnostic, ...]]] = []
        for path in sorted(paths):
            owner = owners.get(path)
            read = read_sources(self.root, [path], self.open_texts)
            sources = [s for s in read.value if len(s.text) <= course.limits.text]
            if owner is None or owner.document is None or not sources:
                return None
            (source,) = sources
            if source != owner.document.source or self._diagnostics_by_file.get(path):
                parsed_document = self.parse(owner, source)
                diagnostics = (*read.diagnostics, *parsed_document.diagnostics)
                changed_owners.append((replace(owner, document=parsed_document.value), diagnostics))
        return changed_owners

    def parse(self, owner: Owner, source: Source) -> Parsed[Document]:
        """Parse a text of a lesson or page, which need not be the one that is saved."""
        assert self.library is not None
        course = self.library.course
        (parsed_document,) = self.reader.read_documents(
            [(source, isinstance(owner, Lesson), course.words_of(owner))], course.callout_names
        )
        return parsed_document

    def take_other_saves(self) -> None:
        """Take saves of files other than documents."""
        with self.condition:
            self.runs.is_all_due = True
            self.notify(is_saved=True)
        self.read()

    def read(self, reader: Reader | None = None, *, is_saved: bool = True) -> bool:
        """Read the whole course; return whether anything has changed.

        `is_saved`: see `edit`.
        """
        reader = reader or self.reader
        while True:
            edits = self.edits
            with self._reading_lock:
                parsed_course = load(self.root, reader, self.open_texts, code=self.code)
                course = parsed_course.value
                reports = Parsed(Reports()) if course is None else shown_reports(self.root, course)
                with self.condition:
                    if edits != self.edits:
                        continue
                    diagnostics = (*parsed_course.diagnostics, *reports.diagnostics)
                    has_changed = self._take_course(course, diagnostics, reports.value)
                    if has_changed:
                        self.notify(is_saved=is_saved)
                    return has_changed

    def read_saved_course(self) -> Course | None:
        """Return the course as it is on the disk, whose scripts are run."""
        texts = self.open_texts
        with self._reading_lock:
            sources = read_sources(self.root, sorted(texts)).value
            if all(source.text == texts[source.path] for source in sources):
                return self.course
            return load(self.root, self.reader, code=self.code).value

    def _take_course(
        self, course: Course | None, diagnostics: Iterable[Diagnostic], reports: Reports
    ) -> bool:
        by_path: dict[str, tuple[Diagnostic, ...]] = {}
        for diagnostic in diagnostics:
            path = diagnostic.span.path
            by_path[path] = (*by_path.get(path, ()), diagnostic)
        is_same = by_path == {
            path: before for path, before in self._diagnostics_by_file.items() if before
        }
        self._diagnostics_by_file = by_path
        if course is not None:
            is_same = is_same and reports == self._reports and course == self.course
            self._reports = reports
            self._show(course)
        return not is_same

    def _show(self, course: Course) -> None:
        results, trials = self.runs.results(course), self.runs.trials
        self._template_diagnostics = ()
        self.library = make_library(course, results, self._assets, self._reports, trials)
        self._targets = link_targets(course)
        if self._site:
            self.files.show(self.library)

    # --- the results of background work

    def take_results(
        self, course: Course, verification: Verification, known_addresses: Addresses
    ) -> None:
        """Take the results of verifying a course; see `RunHistory.take`."""
        results, trials = verification.results, self.runs.trials
        if results.trials != self.runs.last_results.trials:
            trials = publish_trials(results, self._assets)
        with self.condition:
            self.runs.take(course, verification, trials, known_addresses)
            if self.course is not None:
                self._show(self.course)
            self.notify()

    def take_start(self, path: str, last_seconds: float | None) -> None:
        """Take that a script begins, which took so long the last time."""
        with self.condition:
            self.runs.running[path] = time.time(), last_seconds
            self.notify()

    def take_run(self, script: ScriptKey, run: ScriptRun) -> None:
        """Take the result of one script, while others run."""
        with self.condition:
            self.runs.take_run(script, run)
            if self.course is not None:
                self._show(self.course)
            self.notify()

    def make_site(self, pause: Callable[[], None]) -> None:
        """Make all files of the site, and serve them; `pause` is called between pages."""
        if not self._site:
            return
        with self.condition:
            library = self.library
            assert library is not None
            paths = {diagnostic.span.path for diagnostic in self.diagnostics()}
            mistakes = {
                urls.owner_path(owner): self.mistakes(owner.document)
                for owner in library.course.owners
                if owner.document is not None and owner.path in paths
            }
        try:
            site, files = self.files.make(library, mistakes, pause)
        except TemplateFailure as failure:
            self._take_template_failure(failure)
            return
        with self.condition:
            self.files.serve(site, files)
            self.notify()

    # --- files

    def unreadable(self, path: str) -> Diagnostic | None:
        """Why the document of the page at a site path cannot be read at all, if it cannot."""
        for owner in () if self.course is None else self.course.owners:
            if owner.document is None and urls.owner_path(owner) == path:
                diagnostics = self._diagnostics_by_file.get(owner.path, ())
                return next((d for d in diagnostics if d.is_error), None)
        return None

    def find(self, path: str) -> bytes | None:
        """Return a file of the site, if there is one and it can be made."""
        with self.condition:
            if self.unreadable(path) is not None:
                return None
            try:
                return self.files.find(path)
            except TemplateFailure as failure:
                self._take_template_failure(failure)
                return None

    def _take_template_failure(self, failure: TemplateFailure) -> None:
        with self.condition:
            assert self.course is not None
            diagnostics = (template_diagnostic(self.course, failure),)
            if diagnostics != self._template_diagnostics:
                self._template_diagnostics = diagnostics
                self.notify()


def is_marked(diagnostic: Diagnostic, document: Document) -> bool:
    """Whether a diagnostic has a mark in the page of a document, at its place in the text."""
    source = diagnostic.span.source
    is_here = source.path == document.source.path and source.text == document.source.text
    return is_here and diagnostic.rule not in SHOWN_BY_RESULT
