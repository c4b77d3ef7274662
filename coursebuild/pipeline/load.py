"""Disk → Course: read the map, the lessons, the pages and the models, and parse them.

A `Reader` keeps what it reads, and returns summaries; without one documents come with their prose.
Where the map is broken the lessons are parsed all the same, so that one run reports all mistakes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Literal, TypeAlias

from msgspec.structs import replace

from coursebuild.core.checks.compiled import diagnose_orphan_scenarios
from coursebuild.core.checks.lessons import check_course
from coursebuild.core.checks.links import is_whole
from coursebuild.core.engine.store import Store
from coursebuild.core.files.course_features import features_digest, load_course_features
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.read import read_course, read_picture_sizes, read_records, read_sources
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model import (
    Course,
    Declarations,
    Document,
    Lesson,
    Limits,
    Link,
    UrlTarget,
    document_inlines,
    local_file,
)
from coursebuild.core.model.course import (
    BIBLIOGRAPHY,
    CALLOUTS,
    CITATION_STYLE,
    ENGLISH,
    TEMPLATES,
    Theme,
    Words,
)
from coursebuild.core.model.lesson_record import ENDING, record_path
from coursebuild.core.pages.materials import words_for
from coursebuild.core.registry import read_references
from coursebuild.core.run.script_environment import course_environment, engine_version
from coursebuild.core.scripts.edit import check_source_parts, shown_files
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.syntax.document import find_conflict, find_reordering, parse_document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.source import Source, Span
from coursebuild.pipeline.reader import Reader

Code: TypeAlias = Literal["run", "known", "run before", "none", "refuse"]
"""What becomes of a course's own features: they run; they do if they have run before, and if not
are a mistake of the course, or end the command; they are left out; the course is refused.
"""
MAP = "content/course.toml"
_CODE = "code"
"""The kind of entries that name features which have run."""
MAP_TEXT = 1_000_000
"""Characters that the course map may have; the map itself says how long other texts may be."""

_TEXTS = tuple(
    ".bib .css .csv .html .js .json .md .mjs .py .svg .toml .tsv .txt .vtt .xml .yaml .yml".split()
)
"""The ends of names of files whose text is looked through as such."""


def load(
    root: Path,
    reader: Reader | None = None,
    open_texts: Mapping[str, str] = {},
    *,
    code: Code = "run",
) -> Parsed[Course | None]:
    """Read and parse everything below `root`; no course where its map cannot be used.

    `open_texts` is as for `read_course`.

    Raises:
        EffectError: the course brings code that would run here, and `code` refuses it.
        UsageError: its user has never run that code, and `code` asks for it.
    """
    loader = _Loader(root, reader, open_texts, code)
    course = loader.load()
    loader.check_texts(course)
    return Parsed(course, tuple(loader.diagnostics))


def package_files(root: Path, course: Course) -> Iterator[str]:
    """Yield the files of Python in folders that scripts import from, relative to the root."""
    for package in course.packages:
        files = (root / package.path).glob("*.py" if package.path == "." else "**/*.py")
        yield from (file.relative_to(root).as_posix() for file in files)


def load_course(root: Path, *, code: Code = "run before") -> Course:
    """The course below `root`, whatever is wrong in its lessons, for commands that only look.

    Raises:
        UsageError: its map cannot be used, or it brings code that its user has never run.
    """
    loader = _Loader(root, None, {}, code)
    course = loader.load()
    if course is None:
        raise UsageError("the course map cannot be read; `coursebuild check` says why")
    return course


class _Loader:
    """The state of one loading."""

    def __init__(
        self, root: Path, reader: Reader | None, open_texts: Mapping[str, str], code: Code
    ) -> None:
        read = read_course(root, open_texts)
        self.root = root
        self.open_texts = open_texts
        self.code = code
        self.files = read.value
        self.store = Store(root)
        self.unreadable = list(read.value.unreadable)
        """Files that cannot be read, or that are too long."""
        self.diagnostics = list(read.diagnostics)
        if reader is not None:
            self._read_map, self._read_declarations = reader.read_map, reader.read_declarations
            self._read_documents, self._check = reader.read_documents, reader.check
            return
        self._read_map, self._read_declarations = parse_course_map, parse_declarations
        self._check = check_course
        self._read_documents = lambda sources, callouts: [
            parse_document(source, callouts, lesson=lesson, words=words)
            for source, lesson, words in sources
        ]

    def load(self) -> Course | None:
        course = self._parse_map()
        self._drop_long_texts((Limits() if course is None else course.limits).text)
        declarations = self._parse_declarations()
        if course is None:
            if self.files.map is not None:
                lessons = [(source, True, ENGLISH) for source in self.files.lessons]
                self._parse_documents(lessons, frozenset(CALLOUTS))
            defined_by_map = ("math-syntax", "callout-unknown", "symbol-attribute")
            self.diagnostics = [d for d in self.diagnostics if d.rule not in defined_by_map]
            return None
        languages = {course.language, *map(course.language_of, course.owners)}
        words = {name: words_for(template_texts(), name) for name in sorted(languages)}
        course = replace(course, words=words)
        self._compare_lessons(course)
        course = self._attach_documents(course, self._find_pages(course))
        course = replace(
            course,
            models=self.files.models,
            files=(files := self._files_to_show(course)),
            pictures=read_picture_sizes(self.root, course.documents, files),
            records=read_records(self.root, [MAP, *(d.source.path for d in course.documents)]),
            declarations=declarations,
            theme=self._load_theme(course.theme),
            bibliography=self._read_list(BIBLIOGRAPHY, course.limits.text),
            citation_style=self._read_list(CITATION_STYLE, course.limits.text),
        )
        environment = course_environment(self.root, course)
        # The map's interpreter is a program of the course, which a mere look must not start.
        if course.python is None or (environment.value is not None and self.code == "run"):
            references = read_references(course, self.store, environment.value)
            course = replace(course, references=references)
        self.diagnostics += self._check(course)
        self.diagnostics += environment.diagnostics
        if course.python is None or environment.value is not None:
            interpreter = environment.value
            installed = engine_version() if interpreter is None else interpreter.engine
            if course.engine not in (None, installed):
                message = f"the course is written for MuJoCo {course.engine}, and {installed} is "
                message += "installed" + (f" for `{course.python.path}`" if course.python else "")
                help = "install that version, or bring the outputs up to date and change `engine`"
                diagnostic = diagnose("engine-version", course.engine_span, message, help=help)
                self.diagnostics.append(diagnostic)
        self.diagnostics += check_source_parts(course, self._read_text)
        self.diagnostics += _check_unlisted_files(course)
        for package in course.packages:
            if not (self.root / package.path).is_dir():
                message = f"there is no folder `{package.path}`"
                self.diagnostics.append(diagnose("field-value", package.span, message))
        return course

    # --- texts

    def _drop_long_texts(self, limit: int) -> None:
        models = {model.source: model for model in self.files.models}
        self.files = replace(
            self.files,
            lessons=self._drop_long(limit, self.files.lessons),
            pages=self._drop_long(limit, self.files.pages),
            models=tuple(models[source] for source in self._drop_long(limit, models)),
            declarations=self._drop_long(limit, self.files.declarations),
        )

    def _drop_long(self, limit: int, sources: Iterable[Source]) -> tuple[Source, ...]:
        """Return the sources that are not too long; the others count as unreadable."""
        short = []
        for source in sources:
            if len(source.text) <= limit:
                short.append(source)
                continue
            message = f"{source.path} has {len(source.text):_} characters; the limit is {limit:_}"
            help = "make more courses of it"
            if source.path != MAP:
                shorter = "split it" if source.path.endswith(".md") else "shorten it"
                help = f"{shorter}, or set `text` in `[limits]` of the map"
            self.diagnostics.append(
                diagnose("text-long", source.span(limit, limit + 1), message, help=help)
            )
            self.unreadable.append(source.path)
        return tuple(short)

    def check_texts(self, course: Course | None) -> None:
        """Report what is wrong in any text, but lessons and pages, where their parser reports it.

        Merge conflicts, and characters by which a browser shows others in another order.
        """
        sources = [*self.files.declarations, *(model.source for model in self.files.models)]
        sources += [] if self.files.map is None else [self.files.map]
        paths = {*self.files.files}
        if course is not None:
            paths |= {*shown_files(course), *(feature.path for feature in course.features)}
            paths |= {file.path for file in course.theme.css}
            sources += course.theme.templates
            paths |= set(package_files(self.root, course))
        paths -= {source.path for source in (*sources, *self.files.lessons, *self.files.pages)}
        paths -= {document.source.path for document in ([] if course is None else course.documents)}
        # A line of a record is looked up by a hash: it holds beside the marks of a conflict, too.
        texts = (path for path in paths if path.endswith(_TEXTS) and not path.endswith(ENDING))
        for path in sorted(texts):
            text = self._read_text(path)
            sources += [] if text is None else [Source(path, text)]
        conflicts = (find_conflict(source) for source in sources)
        self.diagnostics += (conflict for conflict in conflicts if conflict is not None)
        for source in sources:
            if not source.path.endswith(".toml"):  # whose values are looked at
                whole = source.span(0, len(source.text))
                is_code = source.path.endswith((".js", ".mjs", ".py"))
                self.diagnostics += find_reordering(whole, is_code=is_code)

    def _load_theme(self, theme: Theme) -> Theme:
        if theme == Theme() and not (self.root / TEMPLATES).is_dir():
            return theme
        from coursebuild.pipeline.theme_files import load_theme

        parsed_theme = load_theme(self.root, theme)
        self.diagnostics += parsed_theme.diagnostics
        return parsed_theme.value

    def _read_text(self, path: str) -> str | None:
        file = (self.root / path).resolve()
        if not file.is_file() or not file.is_relative_to(self.root.resolve()):
            return None
        try:
            return file.read_text("utf-8")
        except (OSError, UnicodeDecodeError):
            return None

    def _read_list(self, path: str, limit: int) -> Source | None:
        """A file beside the map that need not be there."""
        if not (self.root / path).is_file():
            return None
        read = read_sources(self.root, [path], self.open_texts)
        self.diagnostics += read.diagnostics
        return next(iter(self._drop_long(limit, read.value)), None)

    def _parse_map(self) -> Course | None:
        if self.files.map is None or not self._drop_long(MAP_TEXT, [self.files.map]):
            return None
        parsed_map = self._read_map(self.files.map)
        self.diagnostics += parsed_map.diagnostics
        if parsed_map.value is not None:
            self._load_features(parsed_map.value)
        return parsed_map.value

    def _load_features(self, course: Course) -> None:
        """Load the features of the course's own, as far as their code may run.

        What has run once at the user's command may run whenever the course is read.
        """
        if self.code == "refuse":
            paths = [feature.path for feature in course.features]
            paths += [TEMPLATES] if (self.root / TEMPLATES).exists() else []
            if paths:
                raise EffectError(
                    f"`--sandbox` is around scripts alone, and `{paths[0]}` is code that the tool "
                    "would run",
                    help="look at what it does, and run the command without `--sandbox`",
                )
        if self.code == "none":
            return
        if course.features:
            store, key = self.store, features_digest(self.root, course)
            is_known = store.peek(_CODE, key, bytes) is not None
            if self.code == "run before" and not is_known:
                raise UsageError(
                    f"`{course.features[0].path}` is code that you have not run in this form",
                    help="look at what it does, and run `coursebuild check`",
                )
            if self.code == "known" and not is_known:
                message = "its features are code that you have not run in this form"
                help = "look at what they do, and run `coursebuild check`"
                span = course.features[0].span
                self.diagnostics.append(diagnose("feature-broken", span, message, help=help))
                return
            if not is_known:
                store.put(_CODE, key, b"")
        self.diagnostics += load_course_features(self.root, course)

    def _parse_declarations(self) -> tuple[Declarations, ...]:
        names = {model.name for model in self.files.models}
        declarations: list[Declarations] = []
        for source in self.files.declarations:
            parsed_file = self._read_declarations(source)
            self.diagnostics += parsed_file.diagnostics
            model_path = source.path.removesuffix(".toml") + ".xml"
            if model_path.removeprefix("models/").removesuffix(".xml") not in names:
                if model_path not in self.unreadable:
                    paths = [model.source.path for model in self.files.models]
                    self.diagnostics.append(diagnose_orphan_scenarios(source, paths))
            elif parsed_file.value is not None:
                declarations.append(parsed_file.value)
        return tuple(declarations)

    # --- lessons and pages

    def _compare_lessons(self, course: Course) -> None:
        paths = {source.path for source in self.files.lessons}
        listed_paths = {lesson.path for lesson in course.lessons}
        unlisted = {s.path: s for s in self.files.lessons if s.path not in listed_paths}
        for lesson in course.lessons:
            if lesson.status == "planned":
                if lesson.path in paths:
                    message = f"lesson {lesson.id} is planned, but there is a file {lesson.path}"
                    help = 'say `status = "draft"` or `"complete"`, or move the file away'
                    self._report("lesson-planned-file", lesson.span, message, help)
            elif lesson.path not in paths and lesson.path not in self.unreadable:
                closest = nearest(lesson.path, unlisted)
                help = 'write it, or say `status = "planned"`'
                if closest is not None:
                    help = f"is it `{closest}`, which the map does not name?"
                    del unlisted[closest]
                message = f"there is no file {lesson.path}"
                self._report("lesson-missing", lesson.span, message, help)
        for source in unlisted.values():
            help = f"add a [[level.lesson]] to {MAP}, or move the file away"
            if source.path.count("/") > 2:
                help = "lessons lie in content/lessons itself: move it there, or out of content/"
            message = f"the course map does not name {source.path}"
            self._report("lesson-unlisted", source.span(0, 0), message, help)

    def _find_pages(self, course: Course) -> list[Source]:
        """Find the texts of the pages of the map, which may lie anywhere in the course's folder."""
        sources = {source.path: source for source in (*self.files.lessons, *self.files.pages)}
        paths = [page.path for page in course.pages]
        unread = [path for path in paths if path not in {*sources, *self.unreadable}]
        further_paths = [path for path in unread if (self.root / path).exists()]
        read = read_sources(self.root, further_paths, self.open_texts)
        self.diagnostics += read.diagnostics
        sources |= {s.path: s for s in self._drop_long(course.limits.text, read.value)}
        for page in course.pages:
            if page.path not in {*further_paths, *sources, *self.unreadable}:
                message = f"there is no file {page.path}"
                help = "write it, or take the page out of the map"
                self._report("page-missing", page.span, message, help)
        for source in self.files.pages:
            if source.path not in paths:
                message = f"the course map does not name {source.path}"
                help = f"add a [[page]] to {MAP}, or move the file away"
                self._report("page-unlisted", source.span(0, 0), message, help)
        return [sources[path] for path in dict.fromkeys(paths) if path in sources]

    def _attach_documents(self, course: Course, pages: Iterable[Source]) -> Course:
        """Parse the lessons, also those that the map does not name, and the pages."""
        planned = {lesson.path for lesson in course.lessons if lesson.status == "planned"}
        owners = {owner.path: owner for owner in course.owners}
        texts = [(s, True) for s in self.files.lessons if s.path not in planned]
        texts += [(source, False) for source in pages]
        sources = [(s, lesson, course.words_of(owners.get(s.path))) for s, lesson in texts]
        documents = self._parse_documents(sources, course.callout_names)

        def attach(lesson: Lesson) -> Lesson:
            return replace(lesson, document=documents.get((lesson.path, True)))

        return replace(
            course,
            levels=tuple(
                replace(level, lessons=tuple(map(attach, level.lessons))) for level in course.levels
            ),
            pages=tuple(
                replace(page, document=documents.get((page.path, False))) for page in course.pages
            ),
        )

    def _parse_documents(
        self, sources: list[tuple[Source, bool, Words]], callouts: frozenset[str]
    ) -> dict[tuple[str, bool], Document]:
        """Parse texts; return the documents by path, and by whether they are lessons."""
        documents = {}
        parsed_documents = self._read_documents(sources, callouts)
        for (source, lesson, _), parsed_document in zip(sources, parsed_documents, strict=True):
            self.diagnostics += parsed_document.diagnostics
            documents[source.path, lesson] = parsed_document.value
        return documents

    def _report(self, rule: str, span: Span, message: str, help: str) -> None:
        self.diagnostics.append(diagnose(rule, span.first_line(), message, help=help))

    def _files_to_show(self, course: Course) -> tuple[str, ...]:
        """The files that a page may show or link to: all but what the course is made of."""
        models = (f"models/{model.name}.xml" for model in self.files.models)
        texts = [source.path for source in (*self.files.lessons, *self.files.pages)]
        texts += [page.path for page in course.pages]
        excluded = {MAP, *texts, *map(record_path, (MAP, *texts)), *models}
        return tuple(path for path in self.files.files if path not in excluded)


def _check_unlisted_files(course: Course) -> Iterator[Diagnostic]:
    folders = ("content/lessons/", "content/pages/")  # files in these have rules of their own
    paths = [path for path in course.files if path.startswith("content/") and path.endswith(".md")]
    paths = [path for path in paths if is_whole(course) and not path.startswith(folders)]
    used_paths = {*shown_files(course)} if paths else set()
    for document in course.documents if paths else ():
        for inline in document_inlines(document):
            if isinstance(inline, Link) and isinstance(inline.target, UrlTarget):
                used_paths.add(local_file(inline.target.url, document.source.path))
    for path in paths:
        if path not in used_paths:
            message = f"the course map does not name {path}, and nothing links to it"
            help = f"add a [[page]] to {MAP}, or move the file out of content/"
            yield diagnose("file-unlisted", Source(path, "").span(0, 0), message, help=help)
