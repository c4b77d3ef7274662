"""The same bytes wherever a course is built, and whether a build is incremental or clean."""

from __future__ import annotations

import io
import os
import pickle
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.files.trust import seal, store_key, unseal
from coursebuild.core.model.results import Formula
from support.built_sites import BuiltCourses, course_copy
from support.edited_course import EDITS, LESSON, NORUN, QUIZ, WORDS, Course, Edit, drawn_pages
from support.live_course import TRIALS, differences
from support.run_code import program, run_code
from support.scratch_course import ROOT, Folder, Make

UNSHARED_KINDS = ("compressed", "fonts", "mjb", "parts", "pictures", "published", "unchanged")
"""Kinds of entries that hold bytes of the site, or that are not shared."""
GLOSSARY, SYMBOLS = "glossary/index.html", "symbols/index.html"


class Trap:
    """A pickle that ends the process which loads it."""

    def __reduce__(self) -> object:
        return os._exit, (70,)


@pytest.fixture(scope="module")
def built_course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course before any edit, with its site."""
    folder = Folder(tmp_path_factory.mktemp("built") / "course")
    Course(folder)
    folder.borrow(stores)
    assert folder.main("build", "--quiet").status == 0
    return folder


@pytest.fixture
def course(built_course: Folder, tmp_path: Path) -> Course:
    return Course(built_course.duplicate(tmp_path / "course"))


def lesson(id: str) -> str:
    return f"lessons/{id}-l{id.replace('.', '')}.html"


def build(course: Course) -> dict[str, bytes]:
    """The site, built anew with the store."""
    shutil.rmtree(course.folder.root / "public", ignore_errors=True)
    assert course.folder.main("build", "--quiet").status == 0
    return course.folder.tree("public")


@pytest.mark.site
def test_an_edit_draws_the_pages_that_show_it(course: Course) -> None:
    assert drawn_pages(course.folder) == set()
    for path in (course.folder.root / "content").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes())
    assert drawn_pages(course.folder) == set(), "they were touched, and no more"
    first, second, third = (lesson(f"1.{n}") for n in (1, 2, 3))
    lists = {"index.html", "levels/1.html", "progress/index.html", "review/index.html"}
    term = "A [thing]{term} is one.\n\nProse"
    equation = "$$\nE = 1\n$$ {#eq:zero}\n\nProse"
    for id, old, new, pages in (
        ("1.2", "Prose", "Other prose", {second}),
        ("1.2", "Other prose", "Prose", set()),  # the pages of before are known
        ("1.2", "[^n]: A note.", "[^n]: Another note.\n\n## Second", {second}),
        ("1.2", "print(2)", "print(22)", {second}),
        ("1.2", "Remark", "Other", {second}),
        ("1.2", "$x_2$", "$y$", {second, SYMBOLS}),
        ("1.2", "$y$", '$x_2${symbol="place"}', {second, SYMBOLS}),
        ("1.2", "First", "Last", {second, SYMBOLS}),
        ("1.3", "Prose", "See [this](lesson:1.1). Prose", {third, first}),
        ("1.3", "See [this]", "Look at [this](lesson:1.1) or [that]", {third}),
        # The index of symbols links to the glossary, which is new.
        ("1.1", "Prose", term, {first, GLOSSARY, SYMBOLS}),
        ("1.2", "Prose", "See [it](term:thing). Prose", {second, GLOSSARY}),
        ("1.1", "Prose", "Other prose", {first}),
        ("1.1", "is one", "is none", {first, GLOSSARY}),
        ("1.1", "= 1\n$$", "= 1\n$$ {#eq:one}", {first}),
        ("1.2", "Prose", "By [](lesson:1.1#eq:one). Prose", {second, first}),
        ("1.1", "Other prose", equation, {first, second}),  # their number has changed
        ("1.1", "E = 1\n$$ {#eq:one}", "E = 11\n$$ {#eq:one}", {first}),
        ("1.1", "Prose", "Prose\n\n```bash {#lst:run}\nls\n```\n\n", {first}),
        ("1.2", "Prose", "By [](lesson:1.1#lst:run). Prose", {second}),
        ("1.1", "```bash {#lst", "```bash {#lst:one}\nls\n```\n\n```bash {#lst", {first, second}),
        ("1.2", "> [!note]", QUIZ + "> [!note]", {second, *lists}),
        ("1.2", "Why?", "Why not?", {second}),  # its key is the same
        ("1.2", '"why"', '"why-not"', {second, *lists}),
    ):
        course.edit(id, old, new)
        assert drawn_pages(course.folder) == pages, new
    page = course.folder.text("content/pages/about.md")
    course.folder.write("content/pages/about.md", page.replace("*it*", "that"))
    assert drawn_pages(course.folder) == {"about.html"}
    course.folder.write("models/box.xml", '<mujoco model="b"/>\n')
    assert drawn_pages(course.folder) == {"models/box.html"}


@pytest.mark.site
def test_an_edit_of_the_map_draws_all_that_show_it(course: Course) -> None:
    course.titles["1.2"] = "New title"
    course.save()
    pages = {"index.html", "levels/1.html", lesson("1.1"), lesson("1.3"), SYMBOLS}
    pages.add("progress/index.html")
    # Lesson 2.1 needs it, as its level says, too.
    assert drawn_pages(course.folder) == pages | {lesson("1.2"), lesson("2.1"), "levels/2.html"}
    course.levels["2"] = "Second"
    course.save()
    levels = {"levels/1.html", "levels/2.html", "progress/index.html"}
    lessons = set(map(lesson, ("1.1", "1.2", "1.3", "2.1", "2.2")))
    assert drawn_pages(course.folder) == {"index.html"} | levels | lessons
    course.edit("1.3", "[!note]", "[!warning]")
    drawn_pages(course.folder)
    course.extra = '[callouts.warning]\nlabel = "Careful"\npromise = "It bites."\n'
    course.save()
    assert drawn_pages(course.folder) == {lesson("1.3")}
    course.extra += "\n[macros]\nvv = '\\mathbf{v}'\n"
    course.edit("1.3", "Remark", "Remark $\\vv$")
    course.save()
    drawn_pages(course.folder)
    course.folder.replace("content/course.toml", "{v}", "{w}")
    assert lesson("1.3") in drawn_pages(course.folder), "a macro is part of every text"
    assert course.folder.main("build", "--quiet").status == 0
    stem = f"public/{lesson('1.3').removesuffix('.html')}"
    copies = [course.folder.text(f"{stem}.{ending}") for ending in ("html", "md", "ipynb")]
    assert all("mathbf{w}" in copy and "vv" not in copy for copy in copies)
    for old, new in (('"Tested"', '"Renamed"'), ("[course]", '[course]\nlicence = "CC0-1.0"')):
        course.folder.replace("content/course.toml", old, new)
        assert course.folder.main("build", "--quiet").status == 0  # over the old site
        for path, page in course.folder.tree("public").items():
            if path.endswith(".html"):
                assert new.split('"')[1].encode() in page and b"Tested" not in page, path


JUNK = (b"null", msgspec.msgpack.encode((["os:system"], [16, "exit 70"])), pickle.dumps(Trap()))


@pytest.mark.long
@pytest.mark.site
def test_entries_that_are_damaged_or_of_somebody_else_are_made_again(course: Course) -> None:
    before = build(course)
    assert course.folder.spoil() > 30
    assert build(course) == before
    folder = course.folder.root / ".coursebuild"
    key = store_key(str(course.folder.root))
    for junk in JUNK:
        kinds = set()
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder).as_posix()
            kind = name.partition("/")[0]
            if path.is_file() and len(path.name) == 64 and kind not in UNSHARED_KINDS:
                path.write_bytes(seal(name, junk, key))
                kinds.add(kind)
        assert {"summaries", "pages", "maps", "index"} <= kinds
        assert build(course) == before, junk
    for kind in ("mathml", "pages"):
        for path in sorted((folder / kind).iterdir()):
            name = f"{kind}/{path.name}"
            value: object = {Formula("x", display=False): 7}
            if kind == "pages":
                data = unseal(name, path.read_bytes(), key) or b""
                value = {**msgspec.msgpack.decode(data), "body": 7}
            path.write_bytes(seal(name, msgspec.msgpack.encode(value), key))
    assert build(course) == before, "a field of another type"


@pytest.mark.site
def test_a_mistake_that_an_edit_makes_elsewhere_is_found(course: Course) -> None:
    course.edit("1.1", "Prose", '<a href="1.2-l12.html#first">x</a>')
    course.edit("1.3", "Prose", "[there](lesson:1.2#first)")
    build(course)
    course.edit("1.2", "## First", "## Last")
    for _ in range(2):
        result = course.folder.main("build")
        assert (result.status, "error[link-anchor]" in result.out) == (1, True)
    course.edit("1.3", "#first", "#last")
    result = course.folder.main("build")
    assert result.status == 1
    assert "content/lessons/1.1-l11.md:" in result.out
    assert "`lessons/1.2-l12.html` has no anchor `#first`" in result.out
    course.edit("1.2", "## Last", "## First")
    course.edit("1.3", "#last", "#first")
    build(course)


# --- any edits


@pytest.mark.long
@pytest.mark.site
@given(
    st.lists(
        st.tuples(
            st.sampled_from(EDITS),
            st.sampled_from(["1.1", "1.2", "1.3", "2.1", "2.2"]),
            st.sampled_from(WORDS),
            st.booleans(),
        ),
        min_size=2,
        max_size=7,
    )
)
@settings(max_examples=5)
def test_after_any_edits_the_site_is_that_of_a_clean_checkout(
    built_course: Folder, stores: Path, edits: list[tuple[Edit, str, str, bool]]
) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        course = Course(built_course.duplicate(Path(scratch).resolve() / "edited"))
        folder = course.folder
        for edit, id, word, builds_between in edits:
            course.apply(edit, id, word)
            if builds_between:
                folder.main("build", "--quiet")
        status = folder.main("build", "--quiet").status
        clean = Folder(folder.root.with_name("clean"))
        clean.copy(folder.root)
        clean.borrow(stores)
        assert clean.main("build", "--quiet").status == status
        if status == 0:
            assert differences(folder.tree("public"), clean.tree("public")) == []


@pytest.mark.long
@pytest.mark.site
def test_copies_of_the_process_give_what_one_gives(tmp_path: Path, stores: Path) -> None:
    sites = []
    for jobs in ("1", "3"):
        course = Course(Folder(tmp_path / f"jobs {jobs}"))
        for n in range(6, 14):
            id = f"1.{n}"
            course.ids.append(id)
            course.titles[id] = f"Title {n}"
            course.write(id, LESSON.format(n=n, next="1.1", script=NORUN.format(n=n)))
        course.save()
        course.folder.borrow(stores)
        result = course.folder.run("build", "--quiet", "--jobs", jobs)
        assert (result.status, result.out, result.err) == (0, "", "")
        sites.append(course.folder.tree("public"))
    assert differences(*sites) == []


def test_many_texts_are_read_by_as_many_processes_as_there_may_be(make: Make) -> None:
    folder = make(*(f"## One\n\nThen $x_{n} > 0$.\n" for n in range(8)))
    process = run_code(program("count_workers"), folder.root)
    assert (process.stdout, process.stderr, process.returncode) == ("2\n", "", 0)


FULL = ROOT / "tests/courses/full/course"


@pytest.fixture(scope="module")
def original(built_courses: BuiltCourses) -> Folder:
    """The course that uses everything, built in a process of the tests."""
    return built_courses["full"]


@pytest.mark.long
@pytest.mark.engine
def test_build_elsewhere_in_another_environment_gives_the_same_bytes(
    original: Folder, tmp_path: Path, stores: Path
) -> None:
    """With the stored results of labs; the next test runs labs again."""
    folder = course_copy("full", tmp_path / "anderswo ünd 別" / "a course", stores)
    for name in TRIALS:
        (folder.root / ".coursebuild" / name).symlink_to(original.root / ".coursebuild" / name)
    environment = {
        "TZ": "Pacific/Kiritimati",
        "LANG": "tr_TR.UTF-8",
        "LC_ALL": "C",
        "PYTHONHASHSEED": "4242",
        "PYTHONOPTIMIZE": "2",
        "SOURCE_DATE_EPOCH": "1",
        "USER": "somebody",
    }
    root = str(folder.root)
    folder.run(
        "-C", root, "build", "--jobs", "3", "--quiet", cwd=tmp_path, env=environment
    ).require_success()
    assert differences(original.tree(), folder.tree()) == []


@pytest.mark.engine
@pytest.mark.slow
def test_build_without_caches_and_with_files_in_another_order_gives_the_same_bytes(
    original: Folder, tmp_path: Path
) -> None:
    """Fonts are cut again, and the files of folders are created in reverse order."""
    root = tmp_path / "reverse"
    for path in sorted(FULL.rglob("*"), reverse=True):
        if path.is_file():
            target = root / path.relative_to(FULL)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
            target.chmod(0o600)
    folder = Folder(root)
    folder.tmp.mkdir()
    folder.run("build", env={"PYTHONHASHSEED": "1"}).require_success()
    assert differences(original.tree(), folder.tree()) == []


@pytest.mark.engine
def test_nothing_in_a_site_says_where_it_was_built(original: Folder) -> None:
    places = [str(place).encode() for place in (original.root.parent, ROOT, sys.prefix)]
    for name, data in original.tree("public").items():
        texts = [data]
        if name.endswith(".zip"):
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                texts += [archive.read(member) for member in archive.namelist()]
        assert not [place for place in places if any(place in text for text in texts)], name
