"""Pages are made again when any value changes that a template can see."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.frame import FrameInputs, Names, PageFrame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.page_inputs import PageHead
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.record import PageRecord
from coursebuild.pipeline.check import read_and_verify
from coursebuild.pipeline.reader import PageRequest, Reader
from coursebuild.pipeline.site import Site, page_request, text_of
from coursebuild.report import Report
from support.built_sites import BuiltCourses
from support.changed_values import changes
from support.scratch_course import ROOT, Folder

pytestmark = pytest.mark.site

BROKEN = {
    *("Course.levels", "Course.pages", "Level.id", "Level.lessons"),
    *("Lesson.id", "Lesson.level", "Page.id"),
}
"""What other values name: changed alone, it leaves a course with a mistake."""


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


def test_each_value_of_a_page_is_in_its_key(
    built_course: tuple[Library, Reader, Folder],
) -> None:
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
    engine="3.14.0",
    python="3.11.7",
    templates=(),
    names=Names(
        style="assets/site.1.css",
        theme_script="assets/theme.1.js",
        script="assets/site.1.js",
        icon="assets/icon.1.svg",
        credits="assets/licences.1.txt",
        touch_icon="assets/touch.1.png",
        scripts=(("data-quiz=", "assets/quiz.1.js"),),
        logo="assets/logo.1.svg",
        logo_dark="assets/logo-dark.1.svg",
        logo_width=40,
    ),
)
HEAD = PageHead("lessons/1.html", "lesson", "First", "What it is about.", Markup("{}"))


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


AUTHOR = {
    "coursebuild/core/syntax/course_schema.py": (
        '    licence: Annotated[\n        str, Meta(description="its name',
        '    author: str = ""\n',
    ),
    "coursebuild/core/syntax/coursemap.py": (
        "        licence=settings.licence,\n",
        "        author=settings.author,\n",
    ),
    "coursebuild/core/model/course.py": (
        "    licence: str\n    engine: str | None\n",
        "    author: str\n",
    ),
    "templates/base.html": ("</footer>\n", "<p>By {{ frame.author }}.</p>\n"),
}
"""A key of the map that every page shows: in each file, a line and what it stands above."""
AUTHOR_OF_FRAME = (
    ("    licence: str\n", "    author: str\n"),
    ("            licence=course.licence,\n", "            author=course.author,\n"),
)
"""The same in `frame.py`."""


def test_a_new_key_of_the_map_in_the_frame_makes_every_page_again(
    tmp_path: Path, stores: Path
) -> None:
    tool, course = tmp_path / "tool", Folder(tmp_path / "course")
    for name in ("coursebuild", "templates"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, tool / name, ignore=ignored)
    for name in ("site", "mjcourse"):
        (tool / name).symlink_to(ROOT / name)
    source = Folder(tool)
    for path, (above, line) in AUTHOR.items():
        source.replace(path, above, line + above)
    course.fill(["## Hello\n\nText.\n"], stores)
    course.replace("content/course.toml", "[course]\n", '[course]\nauthor = "Ada"\n')
    env = {"PYTHONPATH": str(tool)}

    def build() -> dict[str, bytes]:
        result = course.run("build", "--quiet", env=env)
        assert (result.status, result.out) == (0, ""), result
        pages = course.tree("public").items()
        return {path: data for path, data in pages if path.endswith(".html")}

    # The frame does not see the course: a template cannot show what no field of its value holds.
    failure = course.run("build", env=env)
    assert (
        "UndefinedError: 'coursebuild.core.pages.frame.FrameInputs object' has no attribute"
        in failure.err
    )
    for above, line in AUTHOR_OF_FRAME:
        source.replace("coursebuild/core/pages/frame.py", above, line + above)
    first = build()
    assert all(b"<p>By Ada.</p>" in page for page in first.values())
    course.replace("content/course.toml", "Ada", "Grace")
    second = build()
    assert second.keys() == first.keys()
    assert all(b"<p>By Grace.</p>" in page for page in second.values())
