"""Disk → Course: read the map, the lessons, the pages and the models, and parse them.

Entry points: `load(root)`; `load_course(root)`, for commands that need a course. A `Parser` parses
the texts; `documents.Documents` is one that gives what was parsed before.

1. Read everything (`core.files.read`), parse `content/course.toml`. Where the map is broken the
   lessons are parsed all the same, so that all mistakes are told in one run.
2. Parse what `models/NAME.toml` declare of the models beside them.
3. Attach its document to each lesson and page; compare what the map names with what is there.
4. Check the course as a whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.checks.compiled import diagnose_orphan_scenarios
from coursebuild.core.files.course_features import load_course_features
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.read import read_course, read_sources
from coursebuild.core.model import (
    Course,
    Declarations,
    Document,
    Lesson,
    Level,
    Limits,
    Owner,
    Page,
)
from coursebuild.core.model.theme import TEMPLATES, Theme
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.run.interpreter import course_environment
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.versions import engine_version
from coursebuild.core.scripts.source_parts import check_source_parts
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, nearest
from coursebuild.core.text.source import Source

MAP = "content/course.toml"
MAP_TEXT = 1_000_000
"""Characters of the course map, which says how long all other texts may be."""


class Parser:
    """Parses texts and checks courses, each time anew."""

    def ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Hear which texts will be parsed, and which of them are lessons."""

    def document(
        self, source: Source, callouts: frozenset[str], *, lesson: bool
    ) -> Parsed[Document]:
        """The document that a text holds, and what is wrong in it."""
        from coursebuild.core.syntax.document import parse_document

        return parse_document(source, callouts, lesson=lesson)

    def course_map(self, source: Source) -> Parsed[Course | None]:
        """The course that a map describes, and what is wrong in it."""
        from coursebuild.core.syntax.coursemap import parse_course_map

        return parse_course_map(source)

    def declarations(self, source: Source) -> Parsed[Declarations | None]:
        """What a file beside a model declares, and what is wrong in it."""
        from coursebuild.core.syntax.scenarios import parse_declarations

        return parse_declarations(source)

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What is wrong with a course as a whole."""
        from coursebuild.core.checks.course import check_course

        return check_course(course)


def load(
    root: Path,
    parser: Parser | None = None,
    open_texts: Mapping[str, str] = {},
    *,
    trusted: bool = True,
) -> Parsed[Course | None]:
    """Read and parse everything below `root`; no course where its map cannot be used.

    `open_texts` is as for `read_course`.

    Raises:
        EffectError: the course brings code that would run here, and is not `trusted`.
    """
    loader = _Loader(root, Parser() if parser is None else parser, open_texts, trusted=trusted)
    course = loader.course()
    return Parsed(course, tuple(loader.found))


def load_course(root: Path) -> Course:
    """The course below `root`, whatever is wrong in its lessons.

    Raises:
        UsageError: its map cannot be used.
    """
    course = load(root).value
    if course is None:
        raise UsageError("the course map cannot be read; `coursebuild check` says why")
    return course


class _Loader:
    """The state of one loading: what was read, and what was found wrong."""

    def __init__(
        self, root: Path, parser: Parser, open_texts: Mapping[str, str], *, trusted: bool
    ) -> None:
        read = read_course(root, open_texts)
        self.root = root
        self.open_texts = open_texts
        self.trusted = trusted
        self.parser = parser
        self.files = read.value
        self.found = list(read.diagnostics)
        self.sources: Mapping[str, Source] = {}
        self.callouts = frozenset(kind.name for kind in CALLOUTS)
        self.unnamed: dict[str, Source] = {}
        """Lesson files that the map does not name, by path; one that was surely meant is taken out.
        """

    def course(self) -> Course | None:
        """The whole course, or `None` where there is no usable map."""
        course = self._map()
        limit = (Limits() if course is None else course.limits).text
        lessons = self._within(limit, self.files.lessons)
        texts = self._within(limit, self.files.pages)
        short = self._within(limit, (model.source for model in self.files.models))
        self.files = replace(
            self.files,
            lessons=lessons,
            pages=texts,
            models=tuple(model for model in self.files.models if model.source in short),
            declarations=self._within(limit, self.files.declarations),
        )
        declared = self._declared()
        self.sources = {source.path: source for source in (*lessons, *texts)}
        if course is None:
            if self.files.map is not None:
                self._announce(self.files.lessons, ())
                for source in self.files.lessons:
                    self._document(source, lesson=True)
            return None
        self.callouts = frozenset(kind.name for kind in course.callouts)
        self.unnamed = self._unnamed(course)
        planned = {x.path for x in course.lessons if x.status == "planned"}
        named = {page.path for page in course.pages}
        self._announce(
            [source for source in self.files.lessons if source.path not in planned],
            [source for source in self.files.pages if source.path in named],
        )
        levels = tuple(self._level(level) for level in course.levels)
        self._unlisted()
        pages = self._pages(course.pages, course.limits.text)
        theme = self._theme(course.theme)
        self._unlisted_pages(course)
        course = replace(
            course,
            levels=levels,
            pages=pages,
            models=self.files.models,
            files=self._others(course),
            declarations=declared,
            theme=theme,
        )
        self.found += self.parser.check(course)
        environment = course_environment(self.root, course)
        self.found += environment.diagnostics
        if course.python is None or environment.value is not None:
            self.found += _check_engine(course, environment.value)
        self.found += check_source_parts(course, self._text)
        for package in course.packages:
            if not (self.root / package.path).is_dir():
                message = f"there is no folder `{package.path}`"
                self.found.append(diagnose("field-value", package.span, message))
        return course

    def _within(self, limit: int, sources: Iterable[Source]) -> tuple[Source, ...]:
        """Those that are not too long; the others count as such that cannot be read."""
        found = []
        for source in sources:
            if len(source.text) <= limit:
                found.append(source)
                continue
            message = f"{source.path} has {len(source.text):_} characters, and may have {limit:_}"
            help = "make more courses of it"
            if source.path != MAP:
                shorter = "make more lessons of it" if source.path.endswith(".md") else "shorten it"
                help = f"{shorter}, or set `text` in `[limits]` of the map"
            self.found.append(
                diagnose("text-long", source.span(limit, limit + 1), message, help=help)
            )
            unreadable = (*self.files.unreadable, source.path)
            self.files = replace(self.files, unreadable=unreadable)
        return tuple(found)

    def _theme(self, theme: Theme) -> Theme:
        """The theme with its files; most courses have none."""
        if theme == Theme() and not (self.root / TEMPLATES).is_dir():
            return theme
        from coursebuild.pipeline.theme import load_theme

        loaded = load_theme(self.root, theme)
        self.found += loaded.diagnostics
        return loaded.value

    def _text(self, path: str) -> str | None:
        """The text of a file of the project; `None` where there is none."""
        file = (self.root / path).resolve()
        if not file.is_file() or not file.is_relative_to(self.root.resolve()):
            return None
        try:
            return file.read_text("utf-8")
        except (OSError, UnicodeDecodeError):
            return None

    def _map(self) -> Course | None:
        if self.files.map is None or not self._within(MAP_TEXT, [self.files.map]):
            return None
        parsed = self.parser.course_map(self.files.map)
        self.found += parsed.diagnostics
        if parsed.value is not None:
            if not self.trusted:
                _refuse_code(self.root, parsed.value)
            self.found += load_course_features(self.root, parsed.value)
        return parsed.value

    def _declared(self) -> tuple[Declarations, ...]:
        """What stands beside the models; a file without a model is a mistake."""
        models = {model.name for model in self.files.models}
        found: list[Declarations] = []
        for source in self.files.declarations:
            parsed = self.parser.declarations(source)
            self.found += parsed.diagnostics
            model = source.path.removesuffix(".toml") + ".xml"
            if model.removeprefix("models/").removesuffix(".xml") not in models:
                if model not in self.files.unreadable:
                    paths = [one.source.path for one in self.files.models]
                    self.found.append(diagnose_orphan_scenarios(source, paths))
            elif parsed.value is not None:
                found.append(parsed.value)
        return tuple(found)

    def _announce(self, lessons: Sequence[Source], pages: Sequence[Source]) -> None:
        sources = [*((s, True) for s in lessons), *((s, False) for s in pages)]
        self.parser.ahead(sources, self.callouts)

    def _document(self, source: Source, *, lesson: bool) -> Document:
        parsed = self.parser.document(source, self.callouts, lesson=lesson)
        self.found += parsed.diagnostics
        return parsed.value

    def _level(self, level: Level) -> Level:
        return replace(level, lessons=tuple(self._lesson(lesson) for lesson in level.lessons))

    def _lesson(self, lesson: Lesson) -> Lesson:
        source = self.sources.get(lesson.path)
        if lesson.status == "planned":
            if source is not None:
                message = f"lesson {lesson.id} is planned, and there is a file {lesson.path}"
                help = 'say `status = "draft"` or `"complete"`, or move the file away'
                self._report("lesson-planned-file", lesson, message, help)
            return lesson
        if source is not None:
            return replace(lesson, document=self._document(source, lesson=True))
        if lesson.path not in self.files.unreadable:
            near = nearest(lesson.path, self.unnamed)
            help = 'write it, or say `status = "planned"`'
            if near is not None:
                help = f"is it `{near}`, which the map does not name?"
                self._document(self.unnamed.pop(near), lesson=True)
            self._report("lesson-missing", lesson, f"there is no file {lesson.path}", help)
        return lesson

    def _report(self, rule: str, entry: Owner, message: str, help: str) -> None:
        self.found.append(diagnose(rule, entry.span.first_line(), message, help=help))

    def _unnamed(self, course: Course) -> dict[str, Source]:
        named = {lesson.path for lesson in course.lessons}
        return {s.path: s for s in self.files.lessons if s.path not in named}

    def _unlisted(self) -> None:
        for source in self.unnamed.values():
            help = f"add a [[level.lesson]] to {MAP}, or move the file away"
            if source.path.count("/") > 2:
                help = "lessons lie in content/lessons itself: move it there, or out of content/"
            message = f"the course map does not name {source.path}"
            self.found.append(diagnose("lesson-unlisted", source.span(0, 0), message, help=help))
            self._document(source, lesson=True)

    def _unlisted_pages(self, course: Course) -> None:
        named = {page.path for page in course.pages}
        for source in self.files.pages:
            if source.path not in named:
                message = f"the course map does not name {source.path}"
                help = f"add a [[page]] to {MAP}, or move the file away"
                found = diagnose("page-unlisted", source.span(0, 0), message, help=help)
                self.found.append(found)

    def _pages(self, pages: tuple[Page, ...], limit: int) -> tuple[Page, ...]:
        # Such as lie elsewhere were not read with the course.
        paths = (page.path for page in pages)
        away = [path for path in paths if path not in self.files.unreadable]
        away = [p for p in away if p not in self.sources and (self.root / p).exists()]
        read = read_sources(self.root, away, self.open_texts)
        self.found += read.diagnostics
        sources = self._within(limit, read.value)
        if sources:
            self._announce((), sources)
        others = {source.path: source for source in sources}
        return tuple(self._page(page, others) for page in pages)

    def _page(self, page: Page, others: Mapping[str, Source]) -> Page:
        source = self.sources.get(page.path) or others.get(page.path)
        if source is not None:
            return replace(page, document=self._document(source, lesson=False))
        if page.path not in self.files.unreadable and not (self.root / page.path).exists():
            message = f"there is no file {page.path}"
            help = "write it, or take the page out of the map"
            self._report("page-missing", page, message, help)
        return page

    def _others(self, course: Course) -> tuple[str, ...]:
        """The files that a page may show or link to: all but the map, the lessons and the pages."""
        models = (f"models/{model.name}.xml" for model in self.files.models)
        taken = {MAP, *self.sources, *(page.path for page in course.pages), *models}
        return tuple(path for path in self.files.files if path not in taken)


def _refuse_code(root: Path, course: Course) -> None:
    own = [named.path for named in course.features]
    own += [TEMPLATES] if (root / TEMPLATES).exists() else []
    if own:
        raise EffectError(
            f"`--sandbox` is around scripts alone, and `{own[0]}` is code that the tool would run",
            help="look at what it does, and run the command without `--sandbox`",
        )


def _check_engine(course: Course, interpreter: Interpreter | None) -> list[Diagnostic]:
    installed = engine_version() if interpreter is None else interpreter.engine
    if course.engine in (None, installed):
        return []
    where = "" if course.python is None else f" for `{course.python.path}`"
    message = f"the course is written for MuJoCo {course.engine}, and {installed} is installed"
    message += where
    help = "install that version, or bring the outputs up to date and change `engine`"
    return [diagnose("engine-version", course.engine_span, message, help=help)]
