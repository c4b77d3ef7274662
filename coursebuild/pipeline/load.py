"""Disk → Course: read the map, the lessons, the pages and the models, and parse them.

Entry point: `load(root)`.

1. Read and parse `content/course.toml`. Where it is broken the lessons are parsed all the same, so
   that all mistakes are told.
2. Read each lesson and page that the map names; compare with what lies in the folders.
3. Read `models/` and list the other files that pages may use.
"""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, replace
from pathlib import Path

from coursebuild.checks import check_course
from coursebuild.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.effects.read import list_course, read_source
from coursebuild.effects.versions import engine_version
from coursebuild.model import Course, Document, Lesson, Level, MjcfModel, Page, Status
from coursebuild.source import Source
from coursebuild.syntax.coursemap import parse_course_map
from coursebuild.syntax.document import parse_document
from coursebuild.vocabulary import CALLOUTS

MAP = "content/course.toml"


@dataclass(frozen=True, slots=True)
class Loaded:
    """What the disk holds. `course` is `None` when the map cannot be used."""

    course: Course | None
    diagnostics: tuple[Diagnostic, ...]


def load(root: Path) -> Loaded:
    """Read and parse everything below `root`."""
    return _Loader(root).load()


class _Loader:
    """The state of one loading: what was read and what was found wrong."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.found: list[Diagnostic] = []
        self.callouts = frozenset(kind.name for kind in CALLOUTS)

    def load(self) -> Loaded:
        listing = list_course(self.root)
        if MAP not in listing.others:
            span = Source(MAP, "").span()
            help = "a course is a folder with content/course.toml; name it with -C DIR"
            self.found.append(diagnose("map-missing", span, f"there is no {MAP}", help=help))
            return Loaded(None, tuple(self.found))
        course = self._map()
        if course is None:
            for path in listing.lessons:
                self._document(path, lesson=True)
            return Loaded(None, tuple(self.found))
        self.callouts = frozenset(kind.name for kind in course.callouts)
        lessons = frozenset(listing.lessons)
        levels = tuple(self._level(level, lessons) for level in course.levels)
        self._unlisted(course, listing.lessons)
        pages = tuple(self._page(page) for page in course.pages)
        models = tuple(self._models(listing.models))
        mapped = {MAP, *lessons, *(page.path for page in pages)}
        files = tuple(path for path in listing.others if path not in mapped)
        course = replace(course, levels=levels, pages=pages, models=models, files=files)
        self.found += check_course(course)
        self.found += _check_engine(course)
        return Loaded(course, tuple(self.found))

    def _read(self, path: str) -> Source | None:
        parsed = read_source(self.root, path)
        self.found += parsed.diagnostics
        return parsed.value

    def _map(self) -> Course | None:
        source = self._read(MAP)
        if source is None:
            return None
        parsed = parse_course_map(source)
        self.found += parsed.diagnostics
        return parsed.value

    def _document(self, path: str, *, lesson: bool) -> Document | None:
        source = self._read(path)
        if source is None:
            return None
        parsed = parse_document(source, self.callouts, lesson=lesson)
        self.found += parsed.diagnostics
        return parsed.value

    def _level(self, level: Level, present: frozenset[str]) -> Level:
        return replace(level, lessons=tuple(self._lesson(x, present) for x in level.lessons))

    def _lesson(self, lesson: Lesson, present: frozenset[str]) -> Lesson:
        if lesson.status is Status.PLANNED:
            if lesson.path in present:
                message = f"lesson {lesson.id} is planned, and there is a file {lesson.path}"
                help = 'say `status = "draft"` or `"complete"`'
                self.found.append(diagnose("lesson-planned-file", lesson.span, message, help=help))
            return lesson
        if lesson.path not in present:
            near = nearest(lesson.path, present)
            help = f"is it `{near}`?" if near else 'write it, or say `status = "planned"`'
            message = f"there is no file {lesson.path}"
            self.found.append(diagnose("lesson-missing", lesson.span, message, help=help))
            return lesson
        return replace(lesson, document=self._document(lesson.path, lesson=True))

    def _unlisted(self, course: Course, present: tuple[str, ...]) -> None:
        named = {lesson.path for lesson in course.lessons}
        wanted = {
            x.path
            for x in course.lessons
            if x.path not in present and x.status is not Status.PLANNED
        }
        for path in present:
            if path in named:
                continue
            near = nearest(path, wanted)
            help = (
                f"rename it to `{posixpath.basename(near)}`"
                if near
                else f"add a [[level.lesson]] to {MAP}, or move the file away"
            )
            span = Source(path, "").span()
            self.found.append(
                diagnose("lesson-unlisted", span, f"the course map does not name {path}", help=help)
            )
            self._document(path, lesson=True)

    def _page(self, page: Page) -> Page:
        if not (self.root / page.path).is_file():
            self.found.append(diagnose("page-missing", page.span, f"there is no file {page.path}"))
            return page
        return replace(page, document=self._document(page.path, lesson=False))

    def _models(self, paths: tuple[str, ...]) -> list[MjcfModel]:
        models = []
        for path in paths:
            source = self._read(path)
            if source is not None:
                models.append(MjcfModel(path.removeprefix("models/").removesuffix(".xml"), source))
        return models


def _check_engine(course: Course) -> list[Diagnostic]:
    installed = engine_version()
    if course.engine is None or course.engine_span is None or course.engine == installed:
        return []
    message = f"the course is written for MuJoCo {course.engine}, and {installed} is installed"
    help = "install that version, or bring the outputs up to date and change `engine`"
    return [diagnose("engine-version", course.engine_span, message, help=help)]
