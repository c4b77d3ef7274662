"""Notebooks to go on with: addresses of services that run them, and their first cell."""

from __future__ import annotations

import ast
import json
from importlib.metadata import version
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.model.course import Launch
from coursebuild.features.notebook.notebook_files import launch_services
from support.fixture_cases import check_lines, fixture_text
from support.rendered_course import MAP, Make

LESSON = fixture_text("documents/launched.md")
PATH = "lessons/0.1-falling.ipynb"
ALL = Launch(
    repository="https://github.com/some-one/My.Course",
    colab=True,
    binder="https://mybinder.org",
    jupyterhub="https://hub.example.edu/",
    codespaces=True,
)


def addresses(make: Make, launch: Launch) -> list[str]:
    course = replace(make("Text.").course, launch=launch)
    return [address for _, address in launch_services(course, PATH)]


def test_addresses_of_services(make: Make, rewriting: bool) -> None:
    def convert(fields: str) -> list[str]:
        return addresses(make, replace(ALL, **ast.literal_eval(fields)))

    check_lines(Path(__file__).with_name("launch.md"), convert, rewriting=rewriting)


def cells(data: bytes) -> list[str]:
    return ["".join(c["source"]) for c in json.loads(data)["cells"] if c["cell_type"] == "code"]


def test_a_lesson_has_a_button_for_each_service_and_its_notebook_installs(make: Make) -> None:
    launch = '[launch]\ncolab = true\nrepository = "https://github.com/o/r"\nbranch = "a&b"\n'
    plain, launched = (
        make(LESSON, course=text).site()
        for text in (MAP, MAP.replace("[[page]]", f"{launch}[[page]]"))
    )
    page = launched["lessons/0.1-falling.html"].decode()
    address = "https://colab.research.google.com/github/o/r/blob/a%26b/lessons/0.1-falling.ipynb"
    assert f'<a class="service" href="{address}" rel="noopener">Colab</a>' in page
    first, *_ = cells(launched[PATH])
    assert first == f"%pip install -q numpy=={version('numpy')}"
    assert cells(plain[PATH])[0] == f"# %pip install numpy=={version('numpy')}"
    assert 'class="service"' not in plain["lessons/0.1-falling.html"].decode()
    changed = {path for path in plain if plain[path] != launched.get(path)}
    assert {path for path in changed if path.endswith((".ipynb", ".html"))} == {
        PATH,
        "lessons/0.1-falling.html",
        "lessons/1.1-spinning.html",
    }


def test_the_repository_of_the_course_is_used_if_there_is_no_other(make: Make) -> None:
    text = MAP.replace("[[page]]", '[launch]\nbinder = "https://mybinder.org"\n[[page]]')
    course = make("Text.", course=text).course
    ((name, address),) = launch_services(course, PATH)
    assert name == "Binder"
    assert address.startswith(
        "https://mybinder.org/v2/git/https%3A%2F%2Fexample.org%2Frepo/gh-pages"
    )
