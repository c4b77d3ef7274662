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
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.checks.course import check_document
from coursebuild.checks.links import Places, places
from coursebuild.diagnostics import Diagnostic, Parsed
from coursebuild.effects.read import read_sources
from coursebuild.model import Course, Document, Lesson
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import Loaded, load
from coursebuild.pipeline.preview.differences import (
    changed_questions,
    changed_references,
    changed_runs,
    has_errors,
    offered,
    renewed_places,
    same_course,
    same_frame,
    with_owners,
)
from coursebuild.pipeline.preview.memo import Parsing, PerDocument
from coursebuild.pipeline.preview.noted import Noted
from coursebuild.pipeline.preview.pages import Drawn, Pages, site_paths
from coursebuild.pipeline.preview.parts import Parts, Ran
from coursebuild.pipeline.preview.plan import Plan
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.tasks import Task
from coursebuild.render import fonts, urls, zips
from coursebuild.render.assets import Assets
from coursebuild.render.library import Library, Owner, owners
from coursebuild.render.own_pages import own_pages
from coursebuild.render.page_list import PageEntry
from coursebuild.render.shared import PageFacts
from coursebuild.results import CompileResult, LabResult
from coursebuild.source import Source

_Asked: TypeAlias = tuple[str, frozenset[str], bool]
"""A text and how it is to be parsed."""
_WHOLES = 64
"""Documents whose text is remembered though nobody edits them."""
MOST = 8
"""Documents saved at once that are taken one by one; more are read with the whole course."""


class LiveCourse:
    """See the module."""

    def __init__(
        self,
        root: Path,
        assets: Assets,
        subset: Callable[[fonts.FontJob], bytes],
        surroundings: Callable[[Course], zips.Surroundings],
        documents: Documents,
        noted: Noted,
    ) -> None:
        """`documents` gives the skeletons of those that nobody has edited since.

        `noted` says what builds have left of pages.
        """
        self.root = root
        self._noted = noted
        self.documents = documents
        self.changed = threading.Condition(threading.RLock())
        self.version = 0
        """Grows with everything that an open page may show."""
        self.edits = 0
        """Grows with everything that an author did."""
        self.calm = threading.Event()
        """Set as long as nobody is saving: what is done behind makes room for a save."""
        self.calm.set()
        self.course: Course | None = None
        self.parts = Parts(assets)
        self.pages = Pages(
            root, assets, subset, surroundings, self._ready, self._whole, self._known_facts
        )
        self.behind: dict[str, tuple[Diagnostic, ...]] = {}
        """What the slow stages found, by stage."""
        self.busy = "reading the course"
        """What is still done behind, in words; empty where everything is known."""
        self.trouble = ""
        """Why the work behind could not be done, if it could not."""
        self.due = True
        """Whether the course as a whole may be told something else than is known."""
        self._saved = Parsing()
        """Documents that were saved since the course was first read."""
        self._wholes = Parsing(_WHOLES)
        """Others that were drawn."""
        self._skeletons: dict[str, tuple[_Asked, Parsed[Document]]] = {}
        """What `documents` gave, by path."""
        self._offers = PerDocument(offered)
        self._reading = threading.Lock()
        self._found: dict[str, tuple[Diagnostic, ...]] = {}
        """What reading and checking found, by file."""
        self._known: Places | None = None
        self._ids: dict[str, str] = {}
        """Ids of lessons and pages, by the path of their file."""
        self._sites: dict[str, str] = {}
        """Site paths, by the same."""

    def close(self) -> None:
        """End what typesets formulas: a process that ends with it running may hang."""
        with self.changed:
            self.parts.close()
            self.documents.__exit__(None, None, None)

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
            fresh: list[Owner] = []
            found: dict[str, list[Diagnostic]] = {}
            callouts = frozenset(kind.name for kind in self.course.callouts)
            for path in sorted(paths):
                owner = self._owner(path)
                read = read_sources(self.root, [path])
                if owner is None or owner.document is None or not read.value:
                    return None
                source, is_lesson = read.value[0], isinstance(owner, Lesson)
                if source != owner.document.source or self._found.get(path):
                    parsed = self._saved(source, callouts, lesson=is_lesson)
                    fresh.append(replace(owner, document=parsed.value))
                    found[path] = [*read.diagnostics, *parsed.diagnostics]
            return self._planned(fresh, found)

    def _owner(self, path: str) -> Owner | None:
        """The lesson or page whose file this is."""
        id = self._ids.get(path)
        library = self.library
        if library is None or id is None:
            return None
        return library.lessons.get(id) or library.pages.get(id)

    def _planned(self, fresh: list[Owner], found: dict[str, list[Diagnostic]]) -> Plan:
        old, known, before = self.course, self._known, self.library
        assert old is not None and known is not None and before is not None
        if not fresh:
            return Plan(self.edits, old, before, known, {}, {}, None, frozenset(), {})
        course = with_owners(old, fresh)
        library = self.parts.renewed(before, course, fresh)
        known = renewed_places(known, fresh, library)
        documents = {o.path: o.document for o in fresh if o.document is not None}
        self.parts.typeset(documents.values())
        pairs = [(self._document(path), document) for path, document in documents.items()]
        stale = self._stale(pairs, course, library)
        drawn: dict[str, tuple[Drawn, bytes | None]] = {}
        for path, document in documents.items():
            found[path] += check_document(course, document, known)
            if not has_errors(found[path]) and not has_errors(
                self.parts.formula_mistakes(document)
            ):
                page = self.pages.draw(self._sites[path], library)
                # Where all are stale, it is because of what is in all frames.
                drawn[self._sites[path]] = page, None if stale is None else self.pages.framed(page)
        told = {path: tuple(diagnostics) for path, diagnostics in found.items()}
        names = self.pages.names
        return Plan(self.edits, course, library, known, told, drawn, names, stale, documents)

    def _document(self, path: str) -> Document:
        owner = self._owner(path)
        assert owner is not None and owner.document is not None
        return owner.document

    def commit(self, plan: Plan) -> bool:
        """Take over what was planned, unless something else changed in between."""
        with self.changed:
            if plan.edits != self.edits:
                return False
            if plan.found:
                self.due |= self._concerns_others(plan)
                for path in plan.documents:
                    if self._sites[path] not in plan.drawn:
                        self.pages.hold(self._sites[path])
                self.course, self._known = plan.course, plan.known
                self._found |= plan.found
                self.pages.renew(plan.library, plan.stale)
                for path, (drawn, text) in plan.drawn.items():
                    self.pages.put(path, drawn, text if plan.names is self.pages.names else None)
                self._edited()
            return True

    def _concerns_others(self, plan: Plan) -> bool:
        """Whether other documents may be wrong now, or be so no longer."""
        return any(
            bool(self._found.get(path))
            or bool(plan.found[path])
            or self._offers(self._document(path)) != self._offers(document)
            for path, document in plan.documents.items()
        )

    def _ready(self, path: str) -> bool:
        """Make what drawing a page needs; `False` for one that has a mistake."""
        document = self.pages.document(path)
        if document is None:
            return True
        if has_errors(self._found.get(document.source.path, ())):
            return False
        whole = self._whole(document)
        self.parts.typeset([whole])
        return not has_errors(self.parts.formula_mistakes(whole))

    def _whole(self, document: Document) -> Document:
        """A document with its text, given that or what others look at in it."""
        course, source = self.course, document.source
        assert course is not None
        callouts = frozenset(kind.name for kind in course.callouts)
        owner = self._owner(source.path)
        lesson = isinstance(owner, Lesson)
        saved = self._saved.known(source, callouts, lesson=lesson)
        return (saved or self._wholes(source, callouts, lesson=lesson)).value

    def _known_facts(self, page: PageEntry, library: Library) -> PageFacts | None:
        """What a build has noted of a page; of what was edited since it knows nothing."""
        document = page.document(library)
        if document is None:
            return self._noted(page, library, None)
        path = document.source.path
        known = self._skeletons.get(path)
        if known is None or known[1].value is not document or has_errors(self._found.get(path, ())):
            return None
        _, callouts, lesson = known[0]
        return self._noted(page, library, Task.of(document.source, callouts, lesson))

    def _parse(self, source: Source, callouts: frozenset[str], *, lesson: bool) -> Parsed[Document]:
        """A document as far as others look at it; the same text gives the very same document."""
        saved = self._saved.known(source, callouts, lesson=lesson)
        if saved is not None:
            return saved
        asked = source.text, callouts, lesson
        known = self._skeletons.get(source.path)
        if known is None or known[0] != asked:
            known = asked, self.documents.parse(source, callouts, lesson=lesson)
            self._skeletons[source.path] = known
        return known[1]

    def _ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Have those read that are others than before, all at once."""
        new = [
            (source, lesson)
            for source, lesson in sources
            if self._saved.known(source, callouts, lesson=lesson) is None
            and self._skeletons.get(source.path, (None,))[0] != (source.text, callouts, lesson)
        ]
        self.documents.ahead(new, callouts)

    def _forget(self, course: Course | None) -> None:
        """Keep no skeletons of documents that are no more."""
        if course is not None:
            paths = {document.source.path for document in course.documents}
            kept = {path: known for path, known in self._skeletons.items() if path in paths}
            self._skeletons = kept

    # --- everything

    def reread(self) -> bool:
        """Read the whole course; whether anything was not as it was thought to be."""
        with self._reading:
            while True:
                self.due = False
                edits = self.edits
                loaded = load(
                    self.root,
                    self._parse,
                    self._ahead,
                    self.documents.course_map,
                    self.documents.declarations,
                )
                known = places(loaded.course) if loaded.course is not None else None
                reports = self._reports(loaded.course)
                self._forget(loaded.course)
                with self.changed:
                    if edits == self.edits:
                        return self._adopt(loaded, known, reports)

    def _reports(self, course: Course | None) -> Parsed[Reports]:
        """What was recorded and may be shown; of a course that cannot be read, what was before."""
        return Parsed(self.parts.reports) if course is None else shown_reports(self.root, course)

    def _adopt(self, loaded: Loaded, known: Places | None, reports: Parsed[Reports]) -> bool:
        static: dict[str, tuple[Diagnostic, ...]] = {}
        for diagnostic in (*loaded.diagnostics, *reports.diagnostics):
            path = diagnostic.span.path
            static[path] = (*static.get(path, ()), diagnostic)
        told_before = {path: told for path, told in self._found.items() if told}
        old, new = self.course, loaded.course
        measured = reports.value != self.parts.reports
        self.parts.reports = reports.value
        moved = new is not None and (old is None or measured or not same_course(old, new))
        if not moved and static == told_before:
            return False
        for path, told in static.items():
            if has_errors(told) and path in self._sites:
                self.pages.hold(self._sites[path])
        self._found = static
        if new is not None and moved:
            library = self.parts.library(new)
            stale = None
            self._ids = {owner.path: owner.id for owner in owners(new)}
            self._sites = site_paths(new)
            if old is not None and not measured and same_frame(old, new):
                pairs = zip(old.documents, new.documents, strict=True)
                changed = [(one, two) for one, two in pairs if one is not two]
                stale = self._stale(changed, new, library)
            self.course, self._known = new, known
            self.pages.renew(library, stale)
        elif new is not None and self.library is not None:
            # A page may be drawn now that something else was mended.
            wrong = {d.span.path for told in told_before.values() for d in told}
            self.pages.renew(self.library, {self._sites[p] for p in wrong if p in self._sites})
        self._edited()
        return True

    def _stale(
        self, changed: Iterable[tuple[Document, Document]], new: Course, library: Library
    ) -> frozenset[str] | None:
        """The pages that other documents, in the same map, make stale; `None` for all."""
        stale: set[str] = set()
        for before, document in changed:
            site = self._sites[document.source.path]
            stale |= {site, *self._models_of_both(before, document)}
        drawn_from = self.library
        if drawn_from is not None:
            stale |= self._leaning(new, changed_runs(drawn_from.runs, library.runs))
            if len(drawn_from.scripts) != len(library.scripts):
                stale.add(urls.HOME)  # it says how many there are
            if own_pages(drawn_from) != own_pages(library):
                return None  # every page lists them
            stale |= changed_references(drawn_from, library)
            stale |= changed_questions(drawn_from, library)
        return frozenset(stale)

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
        return {
            self._sites[document.source.path]
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
                changed = changed_runs(self.library.runs, library.runs)
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
            documents = (d for d in self.course.documents if self.parts.has_labs(d))
            self.pages.renew(library, {self._sites[d.source.path] for d in documents})
            self.tell()
