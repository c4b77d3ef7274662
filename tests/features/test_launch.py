"""Notebooks to go on with: addresses of services that run them, and their first cell."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.core.model.course import Launch
from coursebuild.features.notebook import launch_services
from support.rendered_course import MAP, Make

LESSON = """## Part

```python file=examples/a.py
import numpy

print("one")
```

Output:

```text
one
```
"""
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


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {},
            [
                "https://colab.research.google.com/github/some-one/My.Course/blob/gh-pages/"
                "lessons/0.1-falling.ipynb",
                "https://mybinder.org/v2/gh/some-one/My.Course/gh-pages"
                "?labpath=lessons%2F0.1-falling.ipynb",
                "https://hub.example.edu/hub/user-redirect/git-pull"
                "?repo=https%3A%2F%2Fgithub.com%2Fsome-one%2FMy.Course&branch=gh-pages"
                "&urlpath=lab%2Ftree%2FMy.Course%2Flessons%2F0.1-falling.ipynb",
                "https://codespaces.new/some-one/My.Course/tree/gh-pages",
            ],
        ),
        (
            {
                "repository": "https://github.com/some-one/My.Course.git/",
                "branch": "féte/a&b#1+2%",
                "folder": "my docs/é?",
            },
            [
                "https://colab.research.google.com/github/some-one/My.Course/blob/"
                "f%C3%A9te%2Fa%26b%231%2B2%25/my%20docs/%C3%A9%3F/lessons/0.1-falling.ipynb",
                "https://mybinder.org/v2/gh/some-one/My.Course/f%C3%A9te/a%26b%231%2B2%25"
                "?labpath=my%20docs%2F%C3%A9%3F%2Flessons%2F0.1-falling.ipynb",
                "https://hub.example.edu/hub/user-redirect/git-pull"
                "?repo=https%3A%2F%2Fgithub.com%2Fsome-one%2FMy.Course"
                "&branch=f%C3%A9te%2Fa%26b%231%2B2%25"
                "&urlpath=lab%2Ftree%2FMy.Course%2Fmy%2520docs%2F%25C3%25A9%253F%2F"
                "lessons%2F0.1-falling.ipynb",
                "https://codespaces.new/some-one/My.Course/tree/f%C3%A9te/a%26b%231%2B2%25",
            ],
        ),
        (
            {
                "repository": "https://gitlab.com/group/sub/course",
                "colab": False,
                "codespaces": False,
                "jupyterhub": None,
            },
            [
                "https://mybinder.org/v2/gl/group%2Fsub%2Fcourse/gh-pages"
                "?labpath=lessons%2F0.1-falling.ipynb"
            ],
        ),
        (
            {
                "repository": "http://git.example.org:8080/~a/course.git",
                "binder": "https://binder.example.org/hub/",
                "colab": False,
                "codespaces": False,
            },
            [
                "https://binder.example.org/hub/v2/git/"
                "http%3A%2F%2Fgit.example.org%3A8080%2F~a%2Fcourse/gh-pages"
                "?labpath=lessons%2F0.1-falling.ipynb",
                "https://hub.example.edu/hub/user-redirect/git-pull"
                "?repo=http%3A%2F%2Fgit.example.org%3A8080%2F~a%2Fcourse&branch=gh-pages"
                "&urlpath=lab%2Ftree%2Fcourse%2Flessons%2F0.1-falling.ipynb",
            ],
        ),
    ],
)
def test_addresses_of_services(make: Make, changes: dict[str, Any], expected: list[str]) -> None:
    assert addresses(make, replace(ALL, **changes)) == expected


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
