"""A course in memory gives the site that a build gives, whatever was edited; so do summaries."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model import Course
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.registry import check_runs, feature_trials
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.preview import rebuild
from support.built_sites import BuiltCourses
from support.edited_course import EDITS, WORDS, Edit, breakage, plan, remove
from support.edited_course import Course as EditedCourse
from support.fixture_cases import fixture_tables, fixture_text
from support.live_course import TRIALS, Builds, Live, differences, share
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import GOOD, ROOT, Folder, Make, block


@pytest.mark.site
@pytest.mark.engine
def test_course_of_every_construct_after_edits_is_what_a_clean_build_gives(
    tmp_path: Path,
    stores: Path,
    built_courses: BuiltCourses,
    live: Callable[[Folder], Live],
    builds: Builds,
) -> None:
    """Results that take long come from a build's store, except those of edited parts."""
    before = built_courses["full"].root
    for name in TRIALS:
        shutil.copytree(before / ".coursebuild" / name, builds.trials / name)
    folder = Folder(tmp_path / "course")
    for top in ("content", "models"):
        shutil.copytree(before / top, folder.root / top)
    folder.borrow(stores)
    share(folder, builds.trials)
    running = live(folder)
    # A lab and a model are moved, and a lab is edited.
    lesson = "content/lessons/A.1-models-and-questions.md"
    folder.write(lesson, "A first paragraph, with $x + ж$.\n\n" + folder.text(lesson))
    assert running.save(lesson)
    folder.replace(lesson, '"title": "A falling box"', '"title": "A box that falls"')
    assert running.save(lesson)
    build = builds(folder)
    assert build is not None
    assert differences(running.site(), build) == []


@pytest.mark.site
def test_nothing_is_new_after_a_touch(make: Make, live: Callable[[Folder], Live]) -> None:
    """Nor for a page outside of `content/`."""
    folder = make(GOOD)
    page = '\n[[page]]\nid = "p"\ntitle = "P"\nfile = "docs/p.md"\n'
    folder.write("content/course.toml", folder.text("content/course.toml") + page)
    folder.write("docs/p.md", "## A page\n\nText.\n")
    running = live(folder)
    running.site()
    version = running.session.version
    for path in (folder.lesson(), "docs/p.md"):
        folder.write(path, folder.read(path))
        assert running.session.edit([path]) is False
    assert running.session.read() is False
    assert running.session.version == version


@pytest.mark.site
def test_a_page_with_a_mistake_is_drawn_and_the_others_go_on(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    running = live(folder)
    first, second = "lessons/1.1-one.html", "lessons/1.2-two.html"
    running.site()
    for mistake, rule in (
        ("[gone](lesson:9.9)\n", "link-lesson"),
        ("$\\frac{1$\n", "math-syntax"),
        ("```quiz\n{\n```\n", "json-syntax"),
    ):
        good = folder.text(folder.lesson())
        folder.write(folder.lesson(), good.replace("## Hello", "## Seen") + mistake)
        assert running.save(folder.lesson())
        assert rule in running.error_rules()
        page = running.find(first) or b""
        assert (b"Seen" in page, page.count(b'id="mistake:')) == (True, 1)
        folder.write(folder.lesson(2), f"## Two after {rule}\n\nText.\n")
        assert running.save(folder.lesson(2))
        assert f"Two after {rule}".encode() in (running.find(second) or b"")
        running.site()
        assert running.find(first) == page
        folder.write(folder.lesson(), good.replace("## Hello", f"## Hello {rule}"))
        assert running.save(folder.lesson())
        assert running.error_rules() == []
        assert f"Hello {rule}".encode() in (running.find(first) or b"")
        folder.write(folder.lesson(), good)
        running.save(folder.lesson())


# --- documents that depend on a lesson


@pytest.mark.site
def test_a_term_that_goes_makes_a_mistake_elsewhere_until_it_comes_back(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make("A [thing]{term} is.\n", "See [it](term:thing).\n")
    first, second = folder.lesson(1), folder.lesson(2)
    running = live(folder)
    for path, old, new, broken in (
        (first, "[thing]{term}", "thing", ["link-term"]),
        (second, "See [it](term:thing)", "A [Thing]{term} is", []),
        (first, "thing", "[thing]{term}", ["term-repeated"]),
        (first, "A [thing]{term} is.\n", "<!-- x -->", ["lesson-empty"]),
    ):
        folder.replace(path, old, new)
        running.save(path)
        running.session.read()
        assert running.error_rules() == broken


# --- background work


@pytest.mark.site
def test_script_that_imports_another_runs_again_when_that_is_edited(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(
        block("first.py", 'print("one")\nVALUE = 1', "one")
        + block("second.py", "import first\nprint(first.VALUE)", "one\n1")
    )
    running = live(folder)
    running.rebuild.run_once()
    assert running.error_rules() == []
    folder.replace(folder.lesson(), "VALUE = 1", "VALUE = 2")
    assert running.save(folder.lesson())
    running.rebuild.run_once()
    assert running.error_rules() == ["output-drift"]


@pytest.mark.site
def test_what_fails_is_said_once_and_tried_again(
    make: Make,
    live: Callable[[Folder], Live],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    running = live(make(GOOD))
    run_once, tries = running.rebuild.run_once, iter(range(4))

    def failing() -> None:
        if next(tries) < 3:
            raise EffectError("the disk is full")
        run_once()
        running.rebuild.fail(KeyboardInterrupt())

    monkeypatch.setattr(running.rebuild, "run_once", failing)
    monkeypatch.setattr(rebuild, "QUIET", 0.01)
    monkeypatch.setattr(rebuild, "RETRY", 0.05)
    with pytest.raises(KeyboardInterrupt):
        running.rebuild.follow()
    assert next(tries, None) is None
    assert capsys.readouterr().err.count("coursebuild: the disk is full\n") == 1
    assert running.session.trouble == ""


@pytest.mark.site
def test_page_that_a_build_has_drawn_is_taken_only_where_it_is_the_same(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\nMore of ж.\n")
    build = builds(folder)
    assert build is not None
    running = live(folder)
    assert running.find("lessons/1.1-one.html") is not None
    assert differences(running.site(), build) == []
    assert folder.spoil()
    assert differences(live(folder).site(), build) == []


@pytest.mark.site
def test_page_with_a_mistake_is_drawn_and_not_taken_from_a_build_before_it(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\n[Nowhere](#nowhere)\n")
    running = live(folder)
    running.rebuild.run_once()
    assert running.error_rules() == ["link-anchor"]
    assert b'id="mistake:' in (running.find("lessons/1.1-one.html") or b"")


IDS = ("1.1", "1.2", "1.3", "2.1")


class Preview:
    """A course in memory that is edited, and clean builds of its files."""

    def __init__(self, folder: Path, stores: Path) -> None:
        self.course = EditedCourse(Folder(folder / "course"))
        self.course.folder.borrow(stores)
        self.builds = Builds(folder, stores)
        self.live = Live(self.course.folder)
        self.close = self.live.close

    def save(self, edit: Edit, id: str, word: str) -> None:
        before = self.course.folder.tree()
        self.course.apply(edit, id, word)
        after = self.course.folder.tree()
        changed_paths = {path for path in before | after if before.get(path) != after.get(path)}
        self.live.save(*sorted(changed_paths))

    def is_right(self) -> bool:
        """Assert that the site is that of a clean build; return whether there is one."""
        build, site = self.builds(self.course.folder), self.live.site()
        assert (self.live.error_rules() == []) is (build is not None)
        assert build is None or differences(site, build) == []
        return build is not None


@pytest.mark.site
def test_after_an_edit_of_each_kind_it_is_what_a_clean_build_gives(
    tmp_path: Path, stores: Path
) -> None:
    with contextlib.closing(Preview(tmp_path, stores)) as preview:
        for number, edit in enumerate(EDITS):
            for _ in range(2 if edit in (plan, remove, breakage) else 1):  # and back again
                preview.save(edit, IDS[number % len(IDS)], WORDS[number % len(WORDS)])
            if number % 4 == 3:
                assert preview.is_right(), edit
        assert preview.is_right()


@pytest.mark.slow
@settings(max_examples=8)
@given(data=st.data())
def test_after_any_edits_it_is_what_a_clean_build_gives(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory, stores: Path
) -> None:
    with contextlib.closing(Preview(tmp_path_factory.mktemp("live"), stores)) as preview:
        for _ in range(data.draw(st.integers(1, 4), label="rounds")):
            choice = st.tuples(st.sampled_from(EDITS), st.sampled_from(IDS), st.sampled_from(WORDS))
            for edit, id, word in data.draw(st.lists(choice, max_size=4), label="edits"):
                preview.save(edit, id, word)
                if data.draw(st.booleans(), label="all of it"):
                    preview.live.rebuild.run_once()
            preview.is_right()


FIXTURES = [
    path for top in ("fixtures", "courses") for path in sorted((ROOT / "tests" / top).rglob("*.md"))
]
ENTRY = '[[level.lesson]]\nid = "1.{0}"\nslug = "l"\ntitle = "L"\nstatus = "complete"\n'


def parts_of(parsed_course: Parsed[Course | None]) -> Iterator[object]:
    """The diagnostics of a course, then what its documents hold for the others."""
    course = parsed_course.value
    assert course is not None
    extracted = extract(course)
    runs = [
        ScriptRun(e.path, Outcome.OK if i % 3 else Outcome.FAILED, 0, "one 1.5\nx 1\n", "", 0.0)
        for i, e in enumerate(extracted.value, 1)
    ]
    verdicts = verify(course, runs)
    yield {(d.rule, d.span.path, d.span.start, d.message) for d in parsed_course.diagnostics}
    yield [(t.text, t.code, t.block.span, t.lines_before) for t in mjcf_texts(course)]
    yield extracted.diagnostics
    yield [(e.path, e.text, e.owner, e.script) for e in extracted.value]
    yield [(v.recording.span, v.recording.body, v.status, v.changes) for v in verdicts]
    yield script_findings(course, course.shown_texts, extracted.value, runs, verdicts)
    yield list(check_runs(course, runs))
    yield [
        (name, trial.owner, trial.block.span) for name, (_, trial) in feature_trials(course).items()
    ]


@pytest.mark.site
def test_course_of_summaries_tells_what_the_whole_course_tells(tmp_path: Path) -> None:
    """For lessons that were just read, and from the store."""
    entries = "".join(ENTRY.format(n) for n in range(len(FIXTURES)))
    folder = Folder(tmp_path)
    folder.write(
        "content/course.toml",
        f'[course]\ntitle = "C"\n\n[[level]]\nid = "1"\ntitle = "L"\n\n{entries}',
    )
    for n, path in enumerate(FIXTURES):
        folder.write(f"content/lessons/1.{n}-l.md", path.read_bytes())
    (diagnostics, *whole) = parts_of(load(tmp_path))
    for _ in range(2):
        with Reader(Options(tmp_path, 1, Store(tmp_path))) as reader:
            (diagnostics_of_summaries, *parts_of_summaries) = parts_of(load(tmp_path, reader))
        assert isinstance(diagnostics_of_summaries, set) and isinstance(diagnostics, set)
        assert len(diagnostics) > 1000
        assert diagnostics_of_summaries > diagnostics, "formulas are looked at as well"
        assert parts_of_summaries == whole


TEXT = fixture_text("documents/fingerprint.md")
VISIBLE_CHANGES = fixture_tables("fingerprint")["changes"]


@pytest.mark.site
def test_fingerprint_changes_with_what_others_see_and_not_with_prose(
    tmp_path: Path, stores: Path
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([TEXT, GOOD], stores)

    def of(text: str) -> str | None:
        folder.write(folder.lesson(), text)
        with Reader(folder.options()) as reader:
            course = load(folder.root, reader).value
            assert isinstance(course, Course)
            return reader.fingerprints(course)[1]

    plain = of(TEXT)
    assert of("Plain words.\n\n" + TEXT) == plain == of(TEXT + "Plain words.\n")
    assert all(old in TEXT for old, _ in VISIBLE_CHANGES)
    assert [new for old, new in VISIBLE_CHANGES if of(TEXT.replace(old, new, 1)) == plain] == []
