"""A course and random edits of it, and the pages that its builds draw."""

from __future__ import annotations

import re
from collections.abc import Callable

from coursebuild.pipeline.publication import make_files
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site
from support.fixture_cases import fixture_text
from support.scratch_course import Folder, block

HEAD = fixture_text("documents/edited_head.toml")
NORUN = block("s{n}.py", "import s1\nprint({n})\n", info="norun")
LESSON = fixture_text("documents/edited_lesson.md")


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
        text = self.folder.text(self.path(id))
        self.write(id, text.replace(old, new, 1))

    def apply(self, edit: Edit, id: str, word: str) -> None:
        if (self.folder.root / self.path(id)).exists() or edit in (plan, remove, turn, retitle):
            edit(self, id, word)
            self.save()

    def save(self) -> None:
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


def drawn_pages(folder: Folder) -> set[str]:
    options = folder.options()
    with Reader(options) as reader:
        report, site = make_files(options, reader, lambda lib: Site(lib, reader, options))
        assert site is not None, report.diagnostics
        assert len(set(site.drawn_paths)) == len(site.drawn_paths)
        return set(site.drawn_paths)


QUIZ = fixture_text("documents/edited_quiz.md")
"""A question, asked in a lesson."""


# --- edits


def prose(course: Course, id: str, text: str) -> None:
    course.edit(id, "Prose", f"{text} Prose")


def heading(course: Course, id: str, text: str) -> None:
    course.edit(id, "## First", f"## {re.sub('[^a-z]', '', text) or 'h'}\n\n## First")


def retitle(course: Course, id: str, text: str) -> None:
    course.titles[id] = f"{re.sub('[^a-z é]', '', text)} {id}"


def script(course: Course, id: str, text: str) -> None:
    course.edit(id, "print(", f"print({text!a}, ")


def plan(course: Course, id: str, text: str) -> None:
    if id in course.planned:
        course.planned.discard(id)
        n = course.ids.index(id) + 1 if id in course.ids else 9
        course.write(id, LESSON.format(n=n, next="1.1", script=""))
    else:
        course.planned.add(id)
        (course.folder.root / course.path(id)).unlink(missing_ok=True)


def remove(course: Course, id: str, text: str) -> None:
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
    """Define a term in a lesson, or replace it by a link to the lesson."""
    path = course.folder.root / course.path(id)
    name = f"[w{id}]{{term}}"
    if name in path.read_text(encoding="utf-8"):
        course.edit(id, name, f"[no term](lesson:{id})")
    else:
        course.edit(id, "Prose", f"A {name} is {text}: $q_{{{id}}}$. Prose")


def label(course: Course, id: str, text: str) -> None:
    course.edit(id, "\n$$\n\n[^n]:", "\n$$ {#eq:e}\n\nBy [](#eq:e) $\\dot q$.\n\n[^n]:")


def ask(course: Course, id: str, text: str) -> None:
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
    course.folder.write("content/images/dot.png", b"\x89PNG" + text.encode())


def breakage(course: Course, id: str, text: str) -> None:
    course.extra = "" if course.extra else '[[silence]]\nrule = "no-such-rule"\nreason = "x"\n'


def run(course: Course, id: str, text: str) -> None:
    """Add a script that runs, or let it print something that differs from the recording."""
    path, name = course.path(id), f"ran{id}.py"
    if name in course.folder.text(path):
        course.edit(id, "print(17)", "print(17.0)")
    else:
        course.edit(id, "> [!note]", block(name, "print(17)", "17", "digits") + "> [!note]")


Edit = Callable[[Course, str, str], None]
EDITS: list[Edit] = [
    *(prose, heading, script, run, term, label, ask, model, page, picture),
    *(retitle, plan, remove, turn, breakage),
]
WORDS = ["a", "word", "*é*", "`code`", "$z$", "ŝ", "<b style='color: red'>x</b>"]
