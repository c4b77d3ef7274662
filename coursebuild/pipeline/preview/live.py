"""A course in memory that follows its files.

Entry point: `LiveCourse`.

1. `plan(paths)` reads the documents that were saved, parses and checks them and draws their pages,
   and changes nothing; `commit` takes that over. So an editor that is still writing costs nothing.
2. `reread()` reads everything, for all other changes, and to be sure: what did not change is not
   parsed again.
3. `take_runs`, `take_models` and `take_labs` bring what running the course found; pages that show
   something of it become stale.
4. Whoever waits for news waits on `changed`; `version` grows with everything that a page may show.

Everything is under one lock, `changed`; what takes long is done outside of it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path

from coursebuild.checks import Places, check_document, places
from coursebuild.diagnostics import Diagnostic, Severity
from coursebuild.effects.read import read_sources
from coursebuild.model import Course, Document, Lesson
from coursebuild.pipeline.load import Loaded, load
from coursebuild.pipeline.preview.memo import Parsing
from coursebuild.pipeline.preview.pages import Drawn, Pages, draw, site_paths
from coursebuild.pipeline.preview.parts import Parts, Ran
from coursebuild.render import fonts, urls, zips
from coursebuild.render.assets import Assets
from coursebuild.render.frame import Names
from coursebuild.render.library import Library, owners
from coursebuild.results import CompileResult, LabResult, ScriptRun
from coursebuild.values import dataclass, replace

MOST = 8
"""Documents saved at once that are taken one by one; more are read with the whole course."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What some saves come to."""

    edits: int
    """The number of the state that it was made from."""
    course: Course
    library: Library
    known: Places
    found: Mapping[str, tuple[Diagnostic, ...]]
    """The mistakes of the documents that changed; empty where none did."""
    drawn: Mapping[str, tuple[Drawn, bytes]]
    """Pages, and their finished texts."""
    names: Names | None
    """Of the shared files that these texts name."""
    stale: frozenset[str]
    """Pages that show something of it as well."""


class LiveCourse:
    """See the module."""

    def __init__(
        self,
        root: Path,
        assets: Assets,
        subset: Callable[[fonts.FontJob], bytes],
        surroundings: Callable[[Course], zips.Surroundings],
    ) -> None:
        self.root = root
        self.changed = threading.Condition(threading.RLock())
        self.version = 0
        """Grows with everything that an open page may show."""
        self.edits = 0
        """Grows with everything that an author did."""
        self.course: Course | None = None
        self.parts = Parts(assets)
        self.pages = Pages(root, assets, subset, surroundings, self._ready)
        self.behind: dict[str, tuple[Diagnostic, ...]] = {}
        """What the slow stages found, by stage."""
        self.busy = "reading the course"
        """What is still done behind, in words; empty where everything is known."""
        self.trouble = ""
        """Why the work behind could not be done, if it could not."""
        self._parse = Parsing()
        self._reading = threading.Lock()
        self._found: dict[str, tuple[Diagnostic, ...]] = {}
        """What reading and checking found, by file."""
        self._known: Places | None = None

    # --- what may be asked

    @property
    def library(self) -> Library | None:
        """The course and its results, for drawing; `None` before a map could be read."""
        return self.pages.library

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that is known to be wrong."""
        with self.changed:
            found = [d for told in (*self._found.values(), *self.behind.values()) for d in told]
            for document in self.course.documents if self.course is not None else ():
                found += self.parts.formula_mistakes(document)
            return tuple(found)

    def is_kept(self, path: str) -> bool:
        """Whether a page is older than its document, which has mistakes."""
        with self.changed:
            return self.pages.has_page(path) and not self._ready(path)

    def find(self, path: str) -> bytes | None:
        """A file of the site, as a build would publish it."""
        with self.changed:
            return self.pages.find(path)

    def tell(self) -> None:
        """Say that there is news."""
        with self.changed:
            self.version += 1
            self.changed.notify_all()

    def _edited(self) -> None:
        """Something is other than it was, and what leans on it is not known yet."""
        self.edits += 1
        self.busy = self.busy or "checking"
        self.tell()

    # --- some documents

    def plan(self, paths: Collection[str]) -> Plan | None:
        """What the saves of these documents come to.

        `None` where only reading everything tells.
        """
        with self.changed:
            if self.course is None or self._known is None or len(paths) > MOST:
                return None
            course = self.course
            fresh: list[Document] = []
            found: dict[str, list[Diagnostic]] = {}
            by_path = {owner.path: owner for owner in owners(course)}
            callouts = frozenset(kind.name for kind in course.callouts)
            for path in sorted(paths):
                owner = by_path.get(path)
                read = read_sources(self.root, [path])
                if owner is None or owner.document is None or not read.value:
                    return None
                is_lesson = isinstance(owner, Lesson)
                parsed = self._parse(read.value[0], callouts, lesson=is_lesson)
                if parsed.value is not owner.document:
                    fresh.append(parsed.value)
                    found[path] = [*read.diagnostics, *parsed.diagnostics]
            return self._planned(_with_documents(course, fresh), fresh, found)

    def _planned(
        self, course: Course, fresh: list[Document], found: dict[str, list[Diagnostic]]
    ) -> Plan:
        old, known = self.course, self._known
        assert old is not None and known is not None
        library = self.parts.library(course)
        known = _renewed(known, course, fresh, library)
        scripts = {path: script for path, (script, _) in library.scripts.items()}
        self.parts.typeset(fresh)
        drawn: dict[str, tuple[Drawn, bytes]] = {}
        paths = site_paths(course)
        for document in fresh:
            path = document.source.path
            found[path] += check_document(course, document, known, scripts)
            if not _wrong(found[path]) and not _wrong(self.parts.formula_mistakes(document)):
                page = draw(self.pages.painter(paths[path]), library)
                drawn[paths[path]] = page, self.pages.framed(page, library)
        stale = self._stale(old, course, library) if fresh else set()
        told = {path: tuple(diagnostics) for path, diagnostics in found.items()}
        names = self.pages.names
        return Plan(self.edits, course, library, known, told, drawn, names, frozenset(stale))

    def commit(self, plan: Plan) -> bool:
        """Take over what was planned, unless something else changed in between."""
        with self.changed:
            if plan.edits != self.edits:
                return False
            if plan.found:
                self.course, self._known = plan.course, plan.known
                self._found |= plan.found
                self.pages.renew(plan.library, plan.stale)
                for path, (drawn, text) in plan.drawn.items():
                    self.pages.put(path, drawn, text if plan.names is self.pages.names else None)
                self._edited()
            return True

    def _ready(self, path: str) -> bool:
        """Make what drawing a page needs; `False` for one that has a mistake."""
        document = self.pages.document(path)
        if document is None:
            return True
        self.parts.typeset([document])
        found = self._found.get(document.source.path, ())
        return not _wrong(found) and not _wrong(self.parts.formula_mistakes(document))

    # --- everything

    def reread(self) -> bool:
        """Read the whole course; whether anything was not as it was thought to be."""
        with self._reading:
            while True:
                edits = self.edits
                loaded = load(self.root, self._parse)
                known = places(loaded.course) if loaded.course is not None else None
                with self.changed:
                    if edits == self.edits:
                        return self._adopt(loaded, known)

    def _adopt(self, loaded: Loaded, known: Places | None) -> bool:
        static: dict[str, tuple[Diagnostic, ...]] = {}
        for diagnostic in loaded.diagnostics:
            path = diagnostic.span.path
            static[path] = (*static.get(path, ()), diagnostic)
        told_before = {path: told for path, told in self._found.items() if told}
        old, new = self.course, loaded.course
        moved = new is not None and (old is None or not _same(old, new))
        if not moved and static == told_before:
            return False
        self._found = static
        if new is not None and moved:
            library = self.parts.library(new)
            stale = None
            if old is not None and _same_frame(old, new):
                stale = self._stale(old, new, library)
            self.course, self._known = new, known
            self.pages.renew(library, stale)
        elif new is not None and self.library is not None:
            # A page may be drawn now that something else was mended.
            wrong = {d.span.path for told in told_before.values() for d in told}
            paths = site_paths(new)
            self.pages.renew(self.library, {paths[path] for path in wrong if path in paths})
        self._edited()
        return True

    def _stale(self, old: Course, new: Course, library: Library) -> set[str]:
        """The pages that other documents, in the same map, make stale."""
        before = {document.source.path: document for document in old.documents}
        paths = site_paths(new)
        stale: set[str] = set()
        for document in new.documents:
            path = document.source.path
            if before[path] is not document:
                stale |= {paths[path], *self._models_of_both(before[path], document)}
        drawn_from = self.library
        if drawn_from is not None:
            stale |= self._leaning(new, _changed_keys(drawn_from.runs, library.runs))
            if len(drawn_from.scripts) != len(library.scripts):
                stale.add(urls.HOME)  # it says how many there are
        return stale

    def _models_of_both(self, old: Document, new: Document) -> Iterable[str]:
        """The pages of models that a document names or named, where that changed."""
        one, two = self.parts.models_of(old), self.parts.models_of(new)
        if one == two:
            return ()
        names = one.by_labs | one.by_scripts | one.by_links
        names |= two.by_labs | two.by_scripts | two.by_links
        return (path for name in names if self.pages.has_page(path := urls.model_page_path(name)))

    def _leaning(self, course: Course, scripts: frozenset[str]) -> set[str]:
        """The pages that show what one of these scripts printed, or how it did."""
        paths = site_paths(course) if scripts else {}
        return {
            paths[document.source.path]
            for document in (course.documents if scripts else ())
            if not scripts.isdisjoint(self.parts.leans_on(document))
        }

    # --- what runs behind

    def take_runs(self, runs: Iterable[Ran], forget: Collection[str] = ()) -> None:
        """Take what scripts did; what those to forget did is known no more."""
        with self.changed:
            for path in forget:
                self.parts.runs.pop(path, None)
            self.parts.runs |= {ran.job.path: ran for ran in runs}
            if self.course is not None and self.library is not None:
                library = self.parts.library(self.course)
                changed = _changed_keys(self.library.runs, library.runs)
                self.pages.renew(library, self._leaning(self.course, changed))
                self.tell()

    def take_models(self, models: tuple[tuple[str, CompileResult], ...]) -> None:
        """Take what compiling the models gave."""
        with self.changed:
            if models != self.parts.models and self.course is not None:
                self.parts.models = models
                self.pages.renew(self.parts.library(self.course))
                self.tell()

    def take_labs(self, labs: tuple[LabResult, ...]) -> None:
        """Take what trying the labs gave."""
        published = self.parts.publish(labs)
        with self.changed:
            self.parts.take_labs(labs, published)
            if self.course is None or self.library is None:
                return
            library = self.parts.library(self.course)
            paths = site_paths(self.course)
            documents = (d for d in self.course.documents if self.parts.has_labs(d))
            self.pages.renew(library, {paths[d.source.path] for d in documents})
            self.tell()


def _wrong(diagnostics: Iterable[Diagnostic]) -> bool:
    return any(d.severity is Severity.ERROR for d in diagnostics)


def _with_documents(course: Course, fresh: Iterable[Document]) -> Course:
    """The course with other documents in the places of those with their paths."""
    by_path = {document.source.path: document for document in fresh}
    if not by_path:
        return course
    levels = tuple(
        replace(
            level,
            lessons=tuple(
                replace(entry, document=by_path[entry.path]) if entry.path in by_path else entry
                for entry in level.lessons
            ),
        )
        if any(entry.path in by_path for entry in level.lessons)
        else level
        for level in course.levels
    )
    pages = tuple(
        replace(page, document=by_path[page.path]) if page.path in by_path else page
        for page in course.pages
    )
    return replace(course, levels=levels, pages=pages)


def _renewed(known: Places, course: Course, fresh: list[Document], library: Library) -> Places:
    """What there is to link to, now that some documents are others."""
    paths = {document.source.path for document in fresh}
    lessons = {o.id: o.document for o in course.lessons if o.path in paths}
    pages = {o.id: o.document for o in course.pages if o.path in paths}
    return replace(
        known,
        lessons={**known.lessons, **lessons},
        pages={**known.pages, **pages},
        scripts=frozenset(library.scripts),
    )


def _changed_keys(old: Mapping[str, ScriptRun], new: Mapping[str, ScriptRun]) -> frozenset[str]:
    return frozenset(path for path in old.keys() | new.keys() if old.get(path) is not new.get(path))


def _same(old: Course, new: Course) -> bool:
    """Whether two readings gave the same course."""
    pairs = zip(old.documents, new.documents, strict=False)
    return _same_frame(old, new) and all(one is two for one, two in pairs)


def _same_frame(old: Course, new: Course) -> bool:
    """Whether two readings differ in nothing but the texts of documents."""
    return (
        old.map.text == new.map.text
        and old.models == new.models
        and old.files == new.files
        and [d.source.path for d in old.documents] == [d.source.path for d in new.documents]
    )
