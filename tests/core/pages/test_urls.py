"""Addresses: relative at every depth, encoded; rooted only on the page for missing ones."""

from __future__ import annotations

from itertools import product
from urllib.parse import unquote, urljoin, urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import local_file
from coursebuild.core.pages.urls import Place, dark_path, file_path

PATHS = [
    "index.html",
    "about.html",
    "404.html",
    "lessons/4.2-mass-and-inertia.html",
    "models/arms/left hand.xml",
    "examples/l4_2.py",
    "a:b.html",
    "levels/ü%23.html",
]


BASES = ("https://h/", "https://h/deep/er/", "file:///home/u/site/")


def test_files_of_a_course_lie_apart_but_for_those_that_a_model_includes() -> None:
    assert file_path("content/lessons/sketch.svg") == "files/lessons/sketch.svg"
    assert dark_path("content/lessons/sketch.svg") == "files/lessons/sketch.dark.svg"
    assert file_path("models/meshes/hand.obj") == "models/meshes/hand.obj"


def test_a_browser_resolves_an_address_to_its_path() -> None:
    for start, end in product(PATHS, PATHS):
        href = Place(start).href(end, "x y")
        assert not href.startswith("/") and "//" not in href, (start, end)
        for base in BASES:
            page = base + (start if start == "index.html" else Place("index.html").href(start))
            address = urlsplit(urljoin(page, href))
            expected = (urlsplit(base).path + end, "x%20y")
            assert (unquote(address.path), address.fragment) == expected, (base, start, end)


def test_addresses_are_as_short_as_they_can_be() -> None:
    place = Place("lessons/1-a.html")
    assert place.href("lessons/1-a.html", "b") == "#b"
    assert place.href("lessons/1-a.html") == "1-a.html"
    assert place.href("lessons/2-b.html") == "2-b.html"
    assert place.href("index.html") == "../index.html"


def test_the_page_for_missing_addresses_starts_at_the_root() -> None:
    place = Place("404.html", "/course/")
    assert place.href("index.html") == "/course/"
    assert place.href("assets/site.css") == "/course/assets/site.css"


@pytest.mark.parametrize(
    ("url", "path"),
    [
        ("sketch.svg", "content/lessons/sketch.svg"),
        ("./a%20b.png", "content/lessons/a b.png"),
        ("../pages/x.csv?raw#L3", "content/pages/x.csv"),
        ("/content/x.png", "content/x.png"),
    ],
)
def test_files_are_named_from_the_document(url: str, path: str) -> None:
    assert local_file(url, "content/lessons/4.2-x.md") == path


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="/"), min_size=1))
def test_the_address_of_any_file_name_leads_to_it(name: str) -> None:
    path = f"files/{name}"
    href = Place("lessons/1-a.html").href(path)
    if name not in (".", ".."):
        assert unquote(urlsplit(urljoin("https://h/lessons/1-a.html", href)).path) == f"/{path}"
