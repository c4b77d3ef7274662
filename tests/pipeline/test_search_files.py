"""The index of the search in a built site: complete, and touched by an edit in few places."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from support.scratch_course import Folder

pytestmark = pytest.mark.site

WORDS = ("gyroscope", "lagrangian", "quaternion", "impulse", "friction", "damping")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course of thirty lessons."""
    folder = Folder(tmp_path_factory.mktemp("search") / "course")
    parts = ['[course]\ntitle = "Long"\n\n[[level]]\nid = "1"\ntitle = "Level"\n']
    for n in range(1, 31):
        parts.append(
            f'[[level.lesson]]\nid = "1.{n}"\nslug = "l{n}"\ntitle = "Lesson {n}"\n'
            'status = "complete"\n'
        )
        word = WORDS[n % len(WORDS)]
        folder.write(
            f"content/lessons/1.{n}-l{n}.md",
            f"## About {word}\n\nThe {word} is number{n}, at $x_{n}$.\n",
        )
    folder.write("content/course.toml", "\n".join(parts))
    folder.borrow(stores)
    assert folder.main("build", "--quiet").status == 0
    return folder


def index(folder: Folder) -> dict[str, bytes]:
    """The files of the search."""
    everything = folder.tree("public").items()
    return {p: d for p, d in everything if p.startswith(("search/", "assets/search/"))}


def test_every_page_is_listed_in_the_order_of_the_course(built: Folder) -> None:
    text = built.text("public/search/index.js")
    pages = json.loads(text.partition(',"",')[2].rstrip()[:-1])["pages"]
    assert [page[3] for page in pages if page[3]] == [f"1.{n}" for n in range(1, 31)]
    files = built.tree("public")
    assert all(page[0] in files and f"assets/search/{page[4]}.js" in files for page in pages)


def test_an_edit_writes_what_it_is_about_and_nothing_else(built: Folder, tmp_path: Path) -> None:
    folder, lesson = built.duplicate(tmp_path / "course"), "content/lessons/1.7-l7.md"
    before = index(folder)
    folder.replace(lesson, "is number7", "is quaintly number7")
    assert folder.main("build", "--quiet").status == 0
    after = index(folder)
    new = [path for path in after if path not in before and path.endswith(".js")]
    assert len(new) == 3, "the text of the page, the word's shard and spelling"
    assert len(after) == len(before)
    same = {path for path in after if after[path] == before.get(path)}
    assert {path for path in after.keys() - same if path in before} == {"search/index.js"}
    # A store that cannot be written is no matter.
    for kind in ("parts", "pages", "summaries"):
        shutil.rmtree(folder.root / ".coursebuild" / kind)
        folder.write(f".coursebuild/{kind}", "in the way")
    folder.replace(lesson, "is quaintly number7", "is number7")
    assert folder.main("build", "--quiet").status == 0
    assert index(folder) == before
