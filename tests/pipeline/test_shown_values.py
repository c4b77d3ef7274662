"""Pages are made again when any value changes that a template can see."""

from __future__ import annotations

import enum
import functools
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest
from markupsafe import Markup
from msgspec import NODEFAULT, Struct
from msgspec.structs import fields, replace

from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Document
from coursebuild.core.model.diet_findings import DietReport
from coursebuild.core.model.measurements import CaseReport, SceneReport
from coursebuild.core.model.results import Reports
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageHead, PageRecord
from coursebuild.core.pages.frame import FrameInputs, Names, PageFrame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.pipeline.check import read_and_verify
from coursebuild.pipeline.reader import PageRequest, Reader
from coursebuild.pipeline.site import Site, page_request, text_of
from coursebuild.report import Report
from support.built_sites import BuiltCourses
from support.scratch_course import ROOT, Folder

SOURCE = Source("a/place.md", "A text.\n")
OPAQUE = (Document, Excerpt, Source, Span)
"""Values that are changed as wholes: a text and places in it."""


def changes(value: object) -> dict[str, Any]:
    """Values with one field changed, by the name of the field, such as `Lesson.title`.

    Each field of a type is changed once, in the first value of that type where it is not empty.
    """
    values_by_name: dict[str, tuple[bool, Any]] = {}
    for name, is_filled, changed in _changes(value):
        if name not in values_by_name or (is_filled and not values_by_name[name][0]):
            values_by_name[name] = is_filled, changed
    return {name: changed for name, (_, changed) in values_by_name.items()}


def _changes(value: Any) -> Iterator[tuple[str, bool, Any]]:
    if isinstance(value, OPAQUE):
        return
    if isinstance(value, Struct):
        for name, hint in _hints(type(value)).items():
            part = getattr(value, name)
            label = f"{type(value).__name__}.{name}"
            yield label, bool(part), replace(value, **{name: replacement(part, hint)})
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, replace(value, **{name: changed})
    elif isinstance(value, tuple):
        for i, part in enumerate(value):
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, (*value[:i], changed, *value[i + 1 :])
    elif isinstance(value, Mapping):
        for key, part in value.items():
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, {**value, key: changed}


@functools.cache
def _hints(kind: type[Struct]) -> dict[str, Any]:
    """The types of the fields of a struct, also of those that its module imports for types only."""
    structs = (s for s in _subclasses(Struct) if s.__module__.startswith("coursebuild."))
    names = {struct.__name__: struct for struct in structs}
    hints = get_type_hints(kind, localns=names)
    if kind is Reports:  # the core does not say what reports are
        hints |= {"scenes": Mapping[str, SceneReport], "diets": Mapping[str, DietReport]}
        hints["cases"] = tuple[CaseReport, ...]
    return {name: hints[name] for name in kind.__struct_fields__}


def _subclasses(kind: type) -> Iterator[type]:
    for subclass in kind.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


def replacement(value: Any, hint: Any) -> Any:
    """Another value of a type."""
    kind = get_origin(hint) or hint
    members = get_args(hint)
    if kind is Literal:
        return next(member for member in members if member != value)
    if value is None:
        return make(
            next(member for member in members if member is not NoneType) if members else str
        )
    if isinstance(value, tuple) and members and members[-1] is not ...:
        return tuple(map(replacement, value, members))
    match value:
        case bool():
            return not value
        case enum.Enum():
            return next(member for member in type(value) if member is not value)
        case int() | float() | Decimal():
            return value + 1
        case str() | bytes():
            return value + type(value)(b"x" if isinstance(value, bytes) else "x")  # type: ignore[operator,arg-type]
        case Source():
            return Source(value.path, f"{value.text}x\n")
        case Span() | Excerpt() | Document():
            return make(type(value))
        case Struct():
            return next(changed for _, _, changed in _changes(value))
        case Mapping() | Collection():
            if value:
                return type(value)()
            return make(hint)
    raise TypeError(f"no other {type(value)}")


def make(hint: Any) -> Any:
    """Some value of a type, and no empty one."""
    kind, members = get_origin(hint) or hint, get_args(hint)
    if kind is Literal:
        return members[0]
    if kind in (Union, UnionType):
        return make(next(member for member in members if member is not NoneType))
    if getattr(kind, "__metadata__", None) or hasattr(hint, "__metadata__"):
        return make(members[0])
    if kind in (int, float, Decimal, bool):
        return kind(1)
    if kind in (str, object, Any, Markup):
        return Markup("made") if kind is Markup else "made"
    if kind is bytes:
        return b"made"
    if kind is Span:
        return SOURCE.span(0, 1)
    if kind is Excerpt:
        return Excerpt(SOURCE, "A", ((0, 0),))
    if kind is Source:
        return SOURCE
    if kind is Document:
        return Document(SOURCE, (), ())
    if issubclass(kind, enum.Enum):
        return next(iter(kind))
    if issubclass(kind, Struct):
        if kind is Struct:
            return make(Sample)
        hints = _hints(kind)
        required = (f.name for f in fields(kind) if f.default is f.default_factory is NODEFAULT)
        return kind(**{name: make(hints[name]) for name in required})
    if issubclass(kind, tuple):
        return tuple(make(member) for member in members if member is not ...)
    if issubclass(kind, Mapping):
        return {make(members[0]): make(members[1])}
    return kind((make(members[0]),))


class Sample(Struct, frozen=True):
    text: str


BROKEN = {
    *("Level.id", "Level.lessons", "Lesson.id", "Lesson.level", "LabOutput.parity"),
}
"""What other values name, or texts: changed alone, it leaves a course with a mistake."""


class UndrawingReader(Reader):
    """Draws no pages: which ones would be drawn is enough."""

    def draw(self, pages: Iterator[PageRequest]) -> Iterator[PageRecord]:
        for _ in pages:
            yield PageRecord("", "", True, "", "", (), (), ())


def read_library(folder: Folder, reader: Reader) -> Library:
    """A course that was built, as the next build has it."""
    checked_course = read_and_verify(folder.options(), reader, static=True)
    assert not isinstance(checked_course, Report) and checked_course.report().ok
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    results = checked_course.verification.results
    return make_library(checked_course.course, results, assets, checked_course.reports)


@pytest.fixture(scope="module")
def built_course(
    built_courses: BuiltCourses, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Library, Reader, Folder]]:
    folder = built_courses["full"].duplicate(tmp_path_factory.mktemp("shown") / "course")
    with UndrawingReader(folder.options()) as reader:
        yield read_library(folder, reader), reader, folder


@pytest.mark.site
def test_no_page_stays_when_a_value_changes_that_it_is_made_of(
    built_course: tuple[Library, Reader, Folder],
) -> None:
    library, reader, folder = built_course
    options = folder.options()
    Site(library, reader, options)  # the last build
    stale, broken = [], set()
    values = library.course, library.results, library.reports
    for name, (course, results, reports) in changes(values).items():
        changed = make_library(course, results, library.assets, reports)
        try:
            keys = {e.path: page_request(e, changed).key for e in page_list(changed)}
        except (KeyError, StopIteration):
            broken.add(name)
            continue
        kept_keys = Site(changed, reader, options, page_list(changed)).keys
        stale += [f"{name}: {path}" for path, key in keys.items() if kept_keys[path] != key]
    assert stale == []
    assert broken == BROKEN


@pytest.mark.site
def test_each_value_of_a_page_is_in_its_key(built_course: tuple[Library, Reader, Folder]) -> None:
    library, _, _ = built_course
    course, names = library.course, set()
    for entry in page_list(library):
        inputs, text = entry.inputs(library), text_of(entry, library)

        language, base_url = course.language, course.base_url
        templates = course.theme.template_texts
        key = PageRequest.of(inputs, text, language, base_url, templates).key
        changed_inputs = changes(inputs)
        requests = [
            PageRequest.of(inputs, text, "de", base_url, templates),
            PageRequest.of(inputs, text, language, "https://example.org/other/", templates),
            PageRequest.of(inputs, text, language, base_url, (("lesson.html", ""),)),
            *(
                PageRequest.of(changed, text, language, base_url, templates)
                for changed in changed_inputs.values()
            ),
        ]
        if text is not None:
            other_text = replace(text, key="another")
            requests.append(PageRequest.of(inputs, other_text, language, base_url, templates))
        assert key not in {request.key for request in requests}, entry.path
        names |= changed_inputs.keys()
    assert {"PageHead.title", "LessonLink.status", "ShownRun.recorded", "LevelView.title"} <= names


FRAME = FrameInputs(
    language="en",
    title="Bodies",
    course_key="bodies",
    base_url="https://example.org/c/",
    licence="CC-BY-4.0",
    source="https://example.org/repository",
    menu=(("about.html", "About"),),
    added_pages=(("glossary/index.html", "Glossary"),),
    versions=("MuJoCo 3.14.0", "Python 3.11.7"),
    templates=(),
    version="1.2",
    is_manual=False,
    names=Names(
        style="assets/site.1.css",
        theme_script="assets/theme.1.js",
        script="assets/site.1.js",
        icon="assets/icon.1.svg",
        credits="assets/licences.1.txt",
        touch_icon="assets/touch.1.png",
        scripts=(("data-quiz=", "assets/quiz.1.js"),),
        fonts=(("", "assets/fonts/text.1.woff2"),),
        logo="assets/logo.1.svg",
        logo_dark="assets/logo-dark.1.svg",
        logo_width=40,
    ),
)
HEAD = PageHead("lessons/1.html", "lesson", "First", "What it is about.", Markup("{}"))


@pytest.mark.site
def test_each_field_of_the_frame_is_shown_and_in_its_key() -> None:
    own_templates = (("base.html", f"{(ROOT / 'templates/base.html').read_text()}<!-- own -->"),)
    frame, assets = replace(FRAME, templates=own_templates), Assets(template_texts(), Bundle())

    def draw(inputs: FrameInputs) -> str:
        return PageFrame(inputs, assets).render(HEAD, ("data-quiz=",), "<main></main>")

    before = draw(frame), step_key("frame", frame)
    unseen = {}
    changed_frames = changes(frame)
    fields = {f"FrameInputs.{name}" for name in FrameInputs.__struct_fields__}
    assert fields | {f"Names.{name}" for name in Names.__struct_fields__} == changed_frames.keys()
    for name, changed in changed_frames.items():
        page, key = draw(changed), step_key("frame", changed)
        unseen |= {name: page} if page == before[0] else {}
        assert key != before[1], name
    assert unseen == {}
