"""A course in memory gives the site that a build gives, whatever was edited before."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.live_course import Builds, Live, differences
from support.scratch_course import GOOD, Folder, block


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


TOGETHER = ("heading", "output", "mistake", "mend", "cut")
"""Edits that go by what others did to the same lesson."""


def begin(where: Path, stores: Path) -> Folder:
    """A course of three lessons and a model."""
    folder = Folder(where / "course")
    lessons = [
        GOOD.replace("hello.py", f"hello{n}.py").replace("## Hello", f"## Hello {n}")
        for n in (1, 2, 3)
    ]
    folder.fill(lessons, stores)
    folder.write("models/ball.xml", '<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
    return folder


@pytest.mark.site
def test_after_an_edit_of_each_kind_it_is_what_a_clean_build_gives(
    tmp_path: Path, stores: Path
) -> None:
    folder = begin(tmp_path, stores)
    builds, author, running = Builds(tmp_path, stores), Author(folder), Live(folder)
    try:
        for number, name in enumerate(EDITS):
            running.save(*getattr(author, name)(2 if name in TOGETHER else number % 3 + 1))
            if name == "mistake":
                assert running.wrong() == ["link-lesson"]
            elif name == "script":
                running.site()
        assert running.wrong() == []
        built = builds(folder)
        assert built is not None
        assert differences(running.site(), built) == []
    finally:
        running.close()


@pytest.mark.slow
@settings(max_examples=8)
@given(data=st.data())
def test_after_any_edits_it_is_what_a_clean_build_gives(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory, stores: Path
) -> None:
    where = tmp_path_factory.mktemp("live")
    folder = begin(where, stores)
    builds, author, running = Builds(where, stores), Author(folder), Live(folder)
    try:
        for _ in range(data.draw(st.integers(1, 4), label="rounds")):
            edits = st.lists(st.tuples(st.sampled_from(EDITS), st.integers(1, 3)), max_size=4)
            for name, lesson in data.draw(edits, label="edits"):
                running.save(*getattr(author, name)(lesson))
                if data.draw(st.booleans(), label="all of it"):
                    running.rebuild.once()
            built = builds(folder)
            site = running.site()
            if built is None:
                assert running.wrong()
            else:
                assert running.wrong() == []
                assert differences(site, built) == []
    finally:
        running.close()
