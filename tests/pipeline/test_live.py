"""A course in memory gives the site that a build gives, whatever was edited before."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from coursekit import GOOD, ROOT, Folder, block
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.effects.runner import ScriptServer
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.preview.behind import Behind
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.serve import live_course
from coursebuild.results import ScriptJob, ScriptRun

Make = Callable[..., Folder]
FULL = ROOT / "tests/courses/full/course"
COPIES = (".br", ".gz")
OURS = (".coursebuild-site", "files.json", "service-worker.js")
"""By which a folder is known for a site of the tool; what keeps it without a network."""
TRIALS = ("labs", "mjb", "pictures")
"""Stores of what takes long, and which live courses and clean builds share in these tests."""


class Live:
    """A live course without the threads of a preview."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        options = Options(folder.root.resolve(), 2, True)
        self.course: LiveCourse = live_course(options)
        self.behind = Behind(self.course, options, Progress(quiet=True))
        self.course.reread()

    def save(self, *paths: str) -> bool:
        """What `follow` does with a save; whether the fast way was taken."""
        plan = self.course.plan(paths)
        if plan is not None and self.course.commit(plan):
            return True
        self.behind.notice()
        self.course.reread()
        return False

    def site(self) -> dict[str, bytes]:
        """Everything, once all is known."""
        self.behind.once()
        found = {path: self.course.find(path) for path in self.course.pages.paths()}
        return {path: data for path, data in found.items() if data is not None}

    def close(self) -> None:
        self.behind.close()
        self.course.close()

    def wrong(self) -> list[str]:
        return sorted(d.rule for d in self.course.diagnostics() if d.severity.value == "error")


@pytest.fixture
def live() -> Iterator[Callable[[Folder], Live]]:
    made: list[Live] = []

    def make(folder: Folder) -> Live:
        made.append(Live(folder))
        return made[-1]

    yield make
    for one in made:
        one.close()


def share(folder: Folder, trials: Path) -> None:
    """Keep trials of labs with other courses."""
    for name in TRIALS:
        (trials / name).mkdir(parents=True, exist_ok=True)
        (folder.root / ".coursebuild" / name).symlink_to(trials / name)


class Builds:
    """Clean builds of what a folder holds, each in a folder of its own."""

    def __init__(self, where: Path, stores: Path) -> None:
        self.where, self.stores, self.numbers = where, stores, itertools.count()

    def __call__(self, folder: Folder) -> dict[str, bytes] | None:
        """The published files, or nothing for a course with mistakes."""
        fresh = Folder(self.where / f"clean {next(self.numbers)}")
        for top in ("content", "models", "docs"):
            if (folder.root / top).is_dir():
                shutil.copytree(folder.root / top, fresh.root / top)
        fresh.borrow(self.stores)
        share(fresh, self.where / "trials")
        done = fresh.main("build")
        if done.status != 0:
            return None
        site = fresh.tree("public")
        return {p: d for p, d in site.items() if not p.endswith(COPIES) and p not in OURS}


@pytest.fixture
def builds(tmp_path: Path, stores: Path) -> Builds:
    return Builds(tmp_path, stores)


def differences(a: dict[str, bytes], b: dict[str, bytes]) -> list[str]:
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))


# --- one edit


def test_the_course_that_uses_everything(
    tmp_path: Path, stores: Path, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = Folder(tmp_path / "course")
    shutil.copytree(FULL, folder.root)
    folder.borrow(stores)
    share(folder, tmp_path / "trials")
    running = live(folder)

    def same() -> None:
        built = builds(folder)
        assert built is not None
        assert differences(running.site(), built) == []

    same()
    # A lab and a model that moved, and one that changed.
    lesson = "content/lessons/A.1-models-and-questions.md"
    folder.write(lesson, "A first paragraph, with $x + ж$.\n\n" + folder.text(lesson))
    assert running.save(lesson)
    same()
    folder.replace(lesson, '"title": "A falling box"', '"title": "A box that falls"')
    assert running.save(lesson)
    same()
    folder.replace("models/box.xml", "<mujoco", "<!-- a box --><mujoco")
    assert not running.save("models/box.xml")
    same()


def test_a_page_is_new_before_anything_else_is_done(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    running = live(folder)
    page = "lessons/1.1-one.html"
    assert b"Hello" in (running.course.find(page) or b"")
    other = running.course.find("lessons/1.2-two.html")
    folder.replace(folder.lesson(), "## Hello", "## Good morning")
    assert running.save(folder.lesson())
    assert b"Good morning" in (running.course.find(page) or b"")
    assert running.course.find("lessons/1.2-two.html") == other


def test_lists_of_lessons_follow_their_questions(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    running = live(folder)
    running.site()
    path = folder.lesson(2)
    asking = '```quiz\n{"id": "q", "title": "Q", "questions": [%s]}\n```\n'
    one, other = (
        f'{{"kind": "open", "id": "{id}", "q": "{id}?", "reference": "So."}}' for id in "ab"
    )
    lists = ("index.html", "levels/1.html", "progress/index.html", "review/index.html")

    def same() -> bool:
        built = builds(folder)
        assert built is not None
        return [running.course.find(p) for p in lists] == [built.get(p) for p in lists]

    for text in (one, f"{one}, {other}", other):
        folder.write(path, GOOD.replace("hello.py", "other.py") + "\n" + asking % text)
        assert running.save(path)
        running.behind.once()
        assert same()
    folder.write(path, GOOD.replace("hello.py", "other.py"))
    assert running.save(path)
    running.behind.once()
    assert running.course.find("review/index.html") is None
    assert same()


def test_nothing_is_new_after_a_touch(make: Make, live: Callable[[Folder], Live]) -> None:
    folder = make(GOOD)
    running = live(folder)
    running.site()
    version = running.course.version
    folder.write(folder.lesson(), folder.read(folder.lesson()))
    plan = running.course.plan([folder.lesson()])
    assert plan is not None and not plan.found
    assert running.course.commit(plan)
    assert running.course.reread() is False
    assert running.course.version == version


def test_nothing_is_new_where_a_page_lies_outside_of_content(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    page = '\n[[page]]\nid = "p"\ntitle = "P"\npath = "docs/p.md"\n'
    folder.write("content/course.toml", folder.read("content/course.toml") + page.encode())
    folder.write("docs/p.md", "## A page\n\nText.\n")
    running = live(folder)
    running.site()
    for _ in range(2):
        assert running.course.reread() is False


def test_a_plan_is_not_taken_over_when_something_else_came_first(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    running = live(folder)
    folder.replace(folder.lesson(), "## Hello", "## First")
    first = running.course.plan([folder.lesson()])
    folder.replace(folder.lesson(), "## First", "## Second")
    second = running.course.plan([folder.lesson()])
    assert first is not None and second is not None
    assert running.course.commit(second)
    assert not running.course.commit(first)
    assert b"Second" in (running.course.find("lessons/1.1-one.html") or b"")


def test_the_last_good_page_stays_and_the_others_go_on(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, "## Two\n")
    running = live(folder)
    one, two = "lessons/1.1-one.html", "lessons/1.2-two.html"
    running.site()
    for mistake, rule in (
        ("[gone](lesson:9.9)\n", "link-lesson"),
        ("$\\frac{1$\n", "math-syntax"),
        ("```quiz\n{\n```\n", "json-syntax"),
    ):
        good = folder.text(folder.lesson())
        before = running.course.find(one)
        folder.write(folder.lesson(), good.replace("## Hello", "## Never seen") + mistake)
        assert running.save(folder.lesson())
        assert rule in running.wrong()
        assert running.course.is_kept(one)
        assert running.course.find(one) == before
        folder.write(folder.lesson(2), f"## Two after {rule}\n")
        assert running.save(folder.lesson(2))
        assert f"Two after {rule}".encode() in (running.course.find(two) or b"")
        running.site()
        assert running.course.find(one) == before
        folder.write(folder.lesson(), good.replace("## Hello", f"## Hello {rule}"))
        assert running.save(folder.lesson())
        assert running.wrong() == []
        assert f"Hello {rule}".encode() in (running.course.find(one) or b"")
        folder.write(folder.lesson(), good)
        running.save(folder.lesson())


def test_a_page_that_was_never_good(make: Make, live: Callable[[Folder], Live]) -> None:
    folder = make(GOOD + "[gone](lesson:9.9)\n")
    running = live(folder)
    page = "lessons/1.1-one.html"
    assert running.course.find(page) is None
    assert running.course.pages.has_page(page)
    folder.write(folder.lesson(), GOOD)
    running.save(folder.lesson())
    assert b"Hello" in (running.course.find(page) or b"")


def test_a_broken_map_changes_nothing_that_is_shown(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    running = live(folder)
    before = running.site()
    good = folder.read("content/course.toml")
    folder.write("content/course.toml", b"[course\n")
    running.save("content/course.toml")
    assert running.wrong() == ["map-syntax"]
    assert {path: running.course.find(path) for path in before} == before
    folder.write("content/course.toml", good)
    running.save("content/course.toml")
    assert running.wrong() == []
    assert running.site() == before


def test_a_mistake_that_another_file_makes_and_mends(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make("## One\n\n## Two {#two}\n", "[There](lesson:1.1#two)\n")
    running = live(folder)
    running.site()
    folder.replace(folder.lesson(), "{#two}", "{#three}")
    assert running.save(folder.lesson())
    running.site()
    assert running.wrong() == ["link-anchor"]
    folder.replace(folder.lesson(), "{#three}", "{#two}")
    assert running.save(folder.lesson())
    site = running.site()
    assert running.wrong() == []
    built = builds(folder)
    assert built is not None and differences(site, built) == []


def test_scripts_run_behind_and_only_those_that_changed(
    make: Make, live: Callable[[Folder], Live], monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[str] = []

    ordinary = ScriptServer.run

    def noted(
        server: ScriptServer, root: Path, todo: Sequence[ScriptJob], **how: Any
    ) -> tuple[ScriptRun, ...]:
        started.extend(job.path for job in todo)
        return ordinary(server, root, todo, **how)

    monkeypatch.setattr(ScriptServer, "run", noted)
    folder = make(*(f"## Lesson\n\n{block(f'{name}.py', 'print(1)', '1')}" for name in "ab"))
    running = live(folder)
    running.site()
    assert sorted(started) == ["examples/a.py", "examples/b.py"]
    folder.replace(folder.lesson(), "## Lesson", "## Another")
    assert running.save(folder.lesson())
    running.site()
    assert len(started) == 2
    folder.replace(folder.lesson(), "print(1)", "print(1 + 0)")
    assert running.save(folder.lesson())
    running.site()
    assert started[2:] == ["examples/a.py"]
    folder.write("models/ball.xml", "<mujoco/>")
    assert not running.save("models/ball.xml")
    running.site()
    assert len(started) == 3


# --- any edits


class Author:
    """Edits of a course of three lessons."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.counter = itertools.count()

    def prose(self, lesson: int) -> list[str]:
        return self.add(lesson, f"Paragraph {next(self.counter)} with `code` and *emphasis*.\n\n")

    def formula(self, lesson: int) -> list[str]:
        return self.add(lesson, f"$$\n\\int x^{{{next(self.counter)}}}\\,dx\n$$\n\n")

    def characters(self, lesson: int) -> list[str]:
        return self.add(lesson, f"{chr(0x3B1 + next(self.counter) % 20)} and → ∮ Ж.\n\n")

    def style(self, lesson: int) -> list[str]:
        return self.add(lesson, f'<p style="margin-top: {next(self.counter)}px">Styled.</p>\n\n')

    def heading(self, lesson: int) -> list[str]:
        return self.add(lesson, f"## Heading {next(self.counter)}\n\n")

    def script(self, lesson: int) -> list[str]:
        number = next(self.counter)
        return self.add(lesson, block(f"made{number}.py", f"print({number})", str(number)))

    def output(self, lesson: int) -> list[str]:
        """A script that prints another thing, with its recorded output."""
        path = self.folder.lesson(lesson)
        number = next(self.counter)
        text = self.folder.text(path)
        self.folder.write(path, text.replace("hello", f"hello{number}"))
        return [path]

    def question(self, lesson: int) -> list[str]:
        number = next(self.counter)
        quiz = (
            f'{{"id": "q{number}", "title": "Quiz", "questions": [{{"kind": "output", '
            f'"q": "What?", "of": "examples/hello1.py", "line": 1}}]}}'
        )
        return self.add(lesson, f"```quiz\n{quiz}\n```\n\n")

    def link(self, lesson: int) -> list[str]:
        return self.add(lesson, "See [the ball](model:ball) and lesson [two](lesson:1.2).\n\n")

    def model(self, lesson: int) -> list[str]:
        size = 1 + next(self.counter)
        text = f"<mujoco><worldbody><geom size='{size}'/></worldbody></mujoco>"
        self.folder.write("models/ball.xml", text)
        return ["models/ball.xml"]

    def picture(self, lesson: int) -> list[str]:
        name = f"pic{next(self.counter)}.svg"
        self.folder.write(f"content/{name}", '<svg xmlns="http://www.w3.org/2000/svg"/>')
        return [f"content/{name}", *self.add(lesson, f"![A picture](../{name})\n\n")]

    def map(self, lesson: int) -> list[str]:
        text = self.folder.text("content/course.toml")
        title = f'title = "Scratch {next(self.counter)}"'
        self.folder.write("content/course.toml", text.replace('title = "Scratch"', title, 1))
        return ["content/course.toml"]

    def mistake(self, lesson: int) -> list[str]:
        return self.add(lesson, "[gone](lesson:9.9)\n\n")

    def mend(self, lesson: int) -> list[str]:
        path = self.folder.lesson(lesson)
        self.folder.write(path, self.folder.text(path).replace("[gone](lesson:9.9)\n\n", ""))
        return [path]

    def cut(self, lesson: int) -> list[str]:
        """Half of what was added is gone."""
        path = self.folder.lesson(lesson)
        kept = self.folder.text(path).split("\n\n## Heading")[0]
        self.folder.write(path, kept + "\n")
        return [path]

    def add(self, lesson: int, text: str) -> list[str]:
        path = self.folder.lesson(lesson)
        self.folder.write(path, self.folder.text(path) + "\n" + text)
        return [path]


EDITS = [name for name in vars(Author) if not name.startswith("_") and name != "add"]


@pytest.mark.slow
@settings(max_examples=6)
@given(data=st.data())
def test_after_any_edits_it_is_what_a_clean_build_gives(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory, stores: Path
) -> None:
    where = tmp_path_factory.mktemp("live")
    folder = Folder(where / "course")
    lessons = [
        GOOD.replace("hello.py", f"hello{n}.py").replace("## Hello", f"## Hello {n}")
        for n in (1, 2, 3)
    ]
    folder.fill(lessons, stores)
    text = '<mujoco><worldbody><geom size="1"/></worldbody></mujoco>'
    folder.write("models/ball.xml", text)
    builds = Builds(where, stores)
    author = Author(folder)
    running = Live(folder)
    try:
        for _ in range(data.draw(st.integers(1, 4), label="rounds")):
            edits = st.lists(st.tuples(st.sampled_from(EDITS), st.integers(1, 3)), max_size=4)
            for name, lesson in data.draw(edits, label="edits"):
                running.save(*getattr(author, name)(lesson))
                if data.draw(st.booleans(), label="all of it"):
                    running.behind.once()
            built = builds(folder)
            site = running.site()
            if built is None:
                assert running.wrong()
            else:
                assert running.wrong() == []
                assert differences(site, built) == []
    finally:
        running.close()
