"""After any edits, and with any number of processes, the site is that of a clean build."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.edited_course import LESSON, NORUN, QUIZ, Course
from support.scratch_course import Folder

pytestmark = pytest.mark.site


def prose(course: Course, id: str, text: str) -> None:
    course.edit(id, "Prose", f"{text} Prose")


def heading(course: Course, id: str, text: str) -> None:
    course.edit(id, "## First", f"## {re.sub('[^a-z]', '', text) or 'h'}\n\n## First")


def retitle(course: Course, id: str, text: str) -> None:
    course.titles[id] = f"{re.sub('[^a-z é]', '', text)} {id}"


def script(course: Course, id: str, text: str) -> None:
    course.edit(id, "print(", f"print({text!a}, ")


def plan(course: Course, id: str, text: str) -> None:
    """A lesson is taken back, or written."""
    if id in course.planned:
        course.planned.discard(id)
        n = course.ids.index(id) + 1 if id in course.ids else 9
        course.write(id, LESSON.format(n=n, next="1.1", script=""))
    else:
        course.planned.add(id)
        (course.folder.root / course.path(id)).unlink(missing_ok=True)


def remove(course: Course, id: str, text: str) -> None:
    """A lesson goes, or comes back at the end of its level."""
    if id in course.ids:
        course.ids.remove(id)
        (course.folder.root / course.path(id)).unlink(missing_ok=True)
    else:
        course.ids.append(id)
        if id not in course.planned:
            course.write(id, LESSON.format(n=7, next="1.1", script=""))


def turn(course: Course, id: str, text: str) -> None:
    course.ids.reverse()


def term(course: Course, id: str, text: str) -> None:
    """A term is defined in a lesson, or no more; others link to the lesson where it was."""
    path = course.folder.root / course.path(id)
    name = f"[w{id}]{{term}}"
    if name in path.read_text(encoding="utf-8"):
        course.edit(id, name, f"[no term](lesson:{id})")
    else:
        course.edit(id, "Prose", f"A {name} is {text}: $q_{{{id}}}$. Prose")


def label(course: Course, id: str, text: str) -> None:
    """A formula gets a label, and is referred to, if it has none."""
    course.edit(id, "\n$$\n\n[^n]:", "\n$$ {#eq:e}\n\nBy [](#eq:e) $\\dot q$.\n\n[^n]:")


def ask(course: Course, id: str, text: str) -> None:
    """A lesson asks something, or something else."""
    path = course.folder.root / course.path(id)
    if "```quiz" in path.read_text(encoding="utf-8"):
        course.edit(id, '"why', '"why-not')
    else:
        course.edit(id, "Prose", QUIZ.replace("asked", f"asked-{id}") + "Prose")


def model(course: Course, id: str, text: str) -> None:
    course.folder.write("models/box.xml", f"<mujoco><!--{text.replace('-', '')}--></mujoco>\n")


def page(course: Course, id: str, text: str) -> None:
    course.folder.write("content/pages/about.md", f"{text}\n\n[m](model:box) and $é$\n")


def picture(course: Course, id: str, text: str) -> None:
    course.folder.write("content/images/dot.png", text.encode())


def breakage(course: Course, id: str, text: str) -> None:
    """What keeps the course from being built, or mends it."""
    course.extra = "" if course.extra else '[[silence]]\nrule = "no-such-rule"\nreason = "x"\n'


EDITS: list[Callable[[Course, str, str], None]] = [
    *(prose, heading, retitle, script, plan, remove, turn, model, page, picture, breakage),
    *(term, label, ask),
]
WORDS = ["a", "word", "*é*", "`code`", "$z$", "ŝ", "<b style='color: red'>x</b>"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course before any edit, with its site."""
    folder = Folder(tmp_path_factory.mktemp("built") / "course")
    Course(folder)
    folder.borrow(stores)
    assert folder.main("build", "--quiet").status == 0
    return folder


@given(
    st.lists(
        st.tuples(
            st.sampled_from(EDITS),
            st.sampled_from(["1.1", "1.2", "1.3", "2.1", "2.2"]),
            st.sampled_from(WORDS),
            st.booleans(),
        ),
        min_size=1,
        max_size=7,
    )
)
@settings(max_examples=8)
def test_after_any_edits_the_site_is_that_of_a_clean_checkout(
    built: Folder,
    stores: Path,
    edits: list[tuple[Callable[[Course, str, str], None], str, str, bool]],
) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Folder(Path(scratch).resolve() / "edited")
        shutil.copytree(built.root, folder.root, symlinks=True)
        folder.tmp.mkdir()
        course = Course(folder)
        for edit, id, word, build in edits:
            if (folder.root / course.path(id)).exists() or edit in (plan, remove, turn, retitle):
                edit(course, id, word)
                course.save()
            if build:
                folder.main("build", "--quiet")
        status = folder.main("build", "--quiet").status
        clean = Folder(folder.root.with_name("clean"))
        for top in ("content", "models"):
            shutil.copytree(folder.root / top, clean.root / top)
        clean.borrow(stores)
        assert clean.main("build", "--quiet").status == status
        if status == 0:
            assert differing(folder, clean) == []


def differing(a: Folder, b: Folder) -> list[str]:
    left, right = a.tree("public"), b.tree("public")
    return sorted(path for path in left.keys() | right.keys() if left.get(path) != right.get(path))


def test_copies_of_the_process_give_what_one_gives(tmp_path: Path, stores: Path) -> None:
    """Few lessons are read here and drawn in copies; many are read there, too."""
    for last in (8, 21):
        sites = []
        for jobs in ("1", "3"):
            folder = Folder(tmp_path / f"{last} lessons, jobs {jobs}")
            course = Course(folder)
            for n in range(6, last + 1):
                id = f"1.{n}"
                course.ids.append(id)
                course.titles[id] = f"Title {n}"
                course.write(id, LESSON.format(n=n, next="1.1", script=NORUN.format(n=n)))
            course.save()
            folder.borrow(stores)
            done = folder.run("build", "--quiet", "--jobs", jobs)
            assert (done.status, done.out, done.err) == (0, "", "")
            sites.append(folder.tree("public"))
        assert sites[0] == sites[1], last
