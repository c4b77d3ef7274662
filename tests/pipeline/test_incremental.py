"""An incremental build gives what a clean one gives, and draws only what has changed."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from coursekit import Folder, block
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.effects.store import Store
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress

HEAD = """
[course]
title = "Tested"
summary = "A course."
base_url = "https://example.org/c/"

[[page]]
id = "about"
title = "About"
file = "content/pages/about.md"
"""
NORUN = block("s{n}.py", "import s1\nprint({n})\n", info="norun")
LESSON = """## First

Prose of {n} with $x_{n}$ and [the next](lesson:{next}).[^n]

{script}
> [!note] Remark
> ![dot](../images/dot.png) and ==more==.

$$
E = {n}
$$

[^n]: A note.
"""


class Course:
    """A course that is edited."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.ids = ["1.1", "1.2", "1.3", "2.1", "2.2"]
        self.titles = {id: f"Title {id}" for id in self.ids}
        self.levels = {"1": "One", "2": "Two"}
        self.needs = {"1.3": ["1.1"], "2.1": ["1.2"]}
        self.planned = {"2.2"}
        self.extra = ""
        for n, id in enumerate(self.ids, 1):
            following = self.ids[n % len(self.ids)]
            if id not in self.planned:
                self.write(id, LESSON.format(n=n, next=following, script=NORUN.format(n=n)))
        folder.write("content/pages/about.md", "About *it*.\n\n## Part\n\nSee [m](model:box).\n")
        folder.write("content/images/dot.png", b"\x89PNG")
        folder.write("models/box.xml", "<mujoco/>\n")
        self.save()

    def path(self, id: str) -> str:
        return f"content/lessons/{id}-l{id.replace('.', '')}.md"

    def write(self, id: str, text: str) -> None:
        self.folder.write(self.path(id), text)

    def edit(self, id: str, old: str, new: str) -> None:
        """An edit in a lesson, as far as there is something to edit."""
        text = self.folder.text(self.path(id))
        self.write(id, text.replace(old, new, 1))

    def save(self) -> None:
        """Write the map."""
        parts = [HEAD, self.extra]
        for level, title in self.levels.items():
            parts.append(f'[[level]]\nid = "{level}"\ntitle = "{title}"\n')
            for id in (id for id in self.ids if id.startswith(f"{level}.")):
                needs = [need for need in self.needs.get(id, []) if need in self.ids]
                parts.append(
                    f'[[level.lesson]]\nid = "{id}"\nslug = "l{id.replace(".", "")}"\n'
                    f'title = "{self.titles[id]}"\nprerequisites = {needs!r}\n'.replace("'", '"')
                    + f'status = "{"planned" if id in self.planned else "complete"}"\n'
                )
        self.folder.write("content/course.toml", "\n".join(parts))


def options(folder: Folder) -> Options:
    return Options(folder.root.resolve(), 1, True)


def drawn(folder: Folder) -> set[str]:
    """The pages that a build draws anew, in words of their own."""
    with prepare(options(folder), Progress(quiet=True)) as prepared:
        assert prepared.report.ok, prepared.report.diagnostics
        assert len(set(prepared.drawn)) == len(prepared.drawn)
        return set(prepared.drawn)


def lesson(id: str) -> str:
    return f"lessons/{id}-l{id.replace('.', '')}.html"


@pytest.fixture(autouse=True)
def nothing_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Documents are fetched anew each time, as they are in a long course."""
    monkeypatch.setattr("coursebuild.pipeline.shelf.ROOM", 0)
    monkeypatch.setattr("coursebuild.pipeline.shelf._LAST", 0)
    monkeypatch.setattr("coursebuild.pipeline.reading.ROOM", 0)


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Course:
    folder = Folder(tmp_path / "course")
    made = Course(folder)
    folder.borrow(stores)
    drawn(folder)
    return made


def test_nothing_changed_draws_nothing(course: Course) -> None:
    assert drawn(course.folder) == set()


def test_a_touched_or_rewritten_file_draws_nothing(course: Course) -> None:
    for path in (course.folder.root / "content").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes())
    assert drawn(course.folder) == set()


def test_prose_draws_its_page(course: Course) -> None:
    course.edit("1.2", "Prose", "Other prose")
    assert drawn(course.folder) == {lesson("1.2")}
    course.edit("1.2", "Other prose", "Prose")
    assert drawn(course.folder) == set(), "what was there before is known"


@pytest.mark.parametrize(
    "edit",
    [
        ("[^n]: A note.", "[^n]: A note.\n\n## Second"),
        ("print(2)", "print(22)"),
        ("A note.", "Another note."),
        ("Remark", "Other"),
    ],
)
def test_what_only_the_page_shows_draws_only_the_page(
    course: Course, edit: tuple[str, str]
) -> None:
    course.edit("1.2", *edit)
    assert drawn(course.folder) == {lesson("1.2")}


@pytest.mark.parametrize(
    "edit", [("$x_2$", "$y$"), ("$x_2$", '$x_2${symbol="place"}'), ("First", "Second")]
)
def test_a_symbol_draws_the_index_as_well(course: Course, edit: tuple[str, str]) -> None:
    course.edit("1.2", *edit)
    assert drawn(course.folder) == {lesson("1.2"), "symbols/index.html"}


def test_a_link_draws_the_lesson_that_it_leads_to(course: Course) -> None:
    course.edit("1.3", "Prose", "See [this](lesson:1.1). Prose")
    assert drawn(course.folder) == {lesson("1.3"), lesson("1.1")}
    course.edit("1.3", "See [this]", "Look at [this](lesson:1.1) or [that]")
    assert drawn(course.folder) == {lesson("1.3")}, "who refers to it is as it was"
    course.write("1.3", LESSON.format(n=3, next="2.1", script=NORUN.format(n=3)))
    assert drawn(course.folder) == set(), "what was there before is known"


def test_a_term_draws_the_glossary_and_who_uses_it(course: Course) -> None:
    glossary = "glossary/index.html"
    course.edit("1.1", "Prose", "A [thing]{term} is one.\n\nProse")
    # The index of symbols leads to the glossary, which was not there.
    assert drawn(course.folder) == {lesson("1.1"), glossary, "symbols/index.html"}
    course.edit("1.2", "Prose", "See [it](term:thing). Prose")
    assert drawn(course.folder) == {lesson("1.2"), glossary}
    course.edit("1.1", "Prose", "Other prose")
    assert drawn(course.folder) == {lesson("1.1")}
    course.edit("1.1", "is one", "is none")
    assert drawn(course.folder) == {lesson("1.1"), glossary}
    course.edit("1.1", "[thing]{term}", "thing")
    course.edit("1.3", "Prose", "A [thing]{term} is one.\n\nProse")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2"), lesson("1.3"), glossary}


def test_the_number_of_a_formula_draws_who_refers_to_it(course: Course) -> None:
    course.edit("1.1", "= 1\n$$", "= 1\n$$ {#eq:one}")
    course.edit("1.2", "Prose", "By [](lesson:1.1#eq:one). Prose")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2")}
    course.edit("1.1", "Prose", "$$\nE = 1\n$$ {#eq:zero}\n\nProse")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2")}
    course.edit("1.1", "E = 1\n$$ {#eq:one}", "E = 11\n$$ {#eq:one}")
    assert drawn(course.folder) == {lesson("1.1")}


QUIZ = """```quiz
{"id": "asked", "title": "Check", "questions": [
  {"kind": "open", "id": "why", "q": "Why?", "reference": "So."}]}
```

"""


def test_a_question_draws_the_lists_of_lessons(course: Course) -> None:
    course.edit("1.2", "Prose", QUIZ + "Prose")
    lists = {"index.html", "levels/1.html", "progress/index.html", "review/index.html"}
    assert drawn(course.folder) == {lesson("1.2"), *lists}
    course.edit("1.2", "Why?", "Why not?")
    assert drawn(course.folder) == {lesson("1.2")}, "its key is the same"
    course.edit("1.2", '"why"', '"why-not"')
    assert drawn(course.folder) == {lesson("1.2"), *lists}


def test_a_title_draws_all_that_name_it(course: Course) -> None:
    course.titles["1.2"] = "New title"
    course.save()
    around = {"index.html", "levels/1.html", lesson("1.1"), lesson("1.3"), "symbols/index.html"}
    around.add("progress/index.html")
    # Lesson 2.1 needs it, which the level of that one says too.
    assert drawn(course.folder) == around | {lesson("1.2"), lesson("2.1"), "levels/2.html"}


def test_the_title_of_a_level_draws_its_lessons_and_its_neighbours(course: Course) -> None:
    course.levels["2"] = "Second"
    course.save()
    levels = {"levels/1.html", "levels/2.html", "progress/index.html"}
    assert drawn(course.folder) == {"index.html", *levels, lesson("2.1"), lesson("2.2")}


def test_a_page_that_moves_draws_those_who_link_to_it(course: Course) -> None:
    course.edit("1.1", "Prose", "[About](page:about#part)")
    drawn(course.folder)
    course.edit("1.3", "Prose", "More")
    assert drawn(course.folder) == {lesson("1.3")}
    page = course.folder.text("content/pages/about.md")
    course.folder.write("content/pages/about.md", page.replace("*it*", "that"))
    assert drawn(course.folder) == {"about.html"}


def test_a_model_draws_its_page(course: Course) -> None:
    course.folder.write("models/box.xml", '<mujoco model="b"/>\n')
    assert drawn(course.folder) == {"models/box.html"}


def test_the_name_of_a_kind_of_callout_draws_the_pages_that_have_one(course: Course) -> None:
    course.edit("1.3", "[!note]", "[!warning]")
    drawn(course.folder)
    course.extra = '[callouts.warning]\nlabel = "Careful"\npromise = "It bites."\n'
    course.save()
    assert drawn(course.folder) == {lesson("1.3")}


def test_the_name_of_the_course_draws_what_tells_it_and_frames_all(course: Course) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    text = course.folder.text("content/course.toml")
    course.folder.write("content/course.toml", text.replace('"Tested"', '"Renamed"'))
    assert course.folder.main("build", "--quiet").status == 0
    for path, page in course.folder.tree("public").items():
        if path.endswith(".html"):
            assert b"Renamed" in page and b"Tested" not in page


def test_a_damaged_store_is_made_again(course: Course) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    before = course.folder.tree("public")
    assert course.folder.spoil() > 30
    course.edit("1.1", "Prose", "Pros")
    course.edit("1.1", "Pros", "Prose")
    shutil.rmtree(course.folder.root / "public")
    assert course.folder.main("build", "--quiet").status == 0
    assert course.folder.tree("public") == before


def test_a_page_that_the_store_has_lost_is_drawn_for_its_frame(
    course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    before = course.folder.tree("public")
    shutil.rmtree(course.folder.root / "public")
    peek = Store.peek
    lost: list[str] = []

    def without_pages(self: Store, kind: str, key: str) -> bytes | None:
        if kind != "pages":
            return peek(self, kind, key)
        lost.append(key)
        return None

    monkeypatch.setattr(Store, "peek", without_pages)
    assert course.folder.main("build", "--quiet").status == 0
    assert course.folder.tree("public") == before
    assert lost


def test_a_broken_link_of_an_unchanged_page_is_found(course: Course) -> None:
    course.edit("1.1", "Prose", '<a href="1.2-l12.html#first">x</a>')
    assert course.folder.main("build", "--quiet").status == 0
    course.edit("1.2", "## First", "## Last")
    done = course.folder.main("build")
    assert done.status == 1
    assert "public/lessons/1.1-l11.html" in done.out
    assert "`lessons/1.2-l12.html` has no anchor `#first`" in done.out
    course.edit("1.2", "## Last", "## First")
    assert course.folder.main("build", "--quiet").status == 0


# --- any edits


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
@settings(max_examples=12)
def test_after_any_edits_the_site_is_that_of_a_clean_checkout(
    stores: Path, edits: list[tuple[Callable[[Course, str, str], None], str, str, bool]]
) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Folder(Path(scratch).resolve() / "edited")
        course = Course(folder)
        folder.borrow(stores)
        assert folder.main("build", "--quiet").status == 0
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
    """With as many lessons as it takes for them to be used."""
    sites = []
    for jobs in ("1", "3"):
        folder = Folder(tmp_path / f"jobs {jobs}")
        course = Course(folder)
        for n in range(6, 22):
            id = f"1.{n}"
            course.ids.append(id)
            course.titles[id] = f"Title {n}"
            course.write(id, LESSON.format(n=n, next="1.1", script=NORUN.format(n=n)))
        course.save()
        folder.borrow(stores)
        done = folder.run("build", "--quiet", "--jobs", jobs)
        assert (done.status, done.out, done.err) == (0, "", "")
        sites.append(folder.tree("public"))
    assert sites[0] == sites[1]
