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
    """A course of seventy lessons."""
    folder = Folder(tmp_path_factory.mktemp("search") / "course")
    parts = ['[course]\ntitle = "Long"\n\n[[level]]\nid = "1"\ntitle = "Level"\n']
    for n in range(1, 71):
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


@pytest.fixture
def folder(built: Folder, tmp_path: Path) -> Folder:
    """A copy of it, to be edited."""
    folder = Folder(tmp_path / "course")
    shutil.copytree(built.root, folder.root, symlinks=True)
    folder.tmp.mkdir()
    return folder


def index(folder: Folder) -> dict[str, bytes]:
    """The files of the search."""
    root = folder.root / "public"
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for top in ("search", "assets/search")
        for path in sorted((root / top).iterdir())
    }


def listing(folder: Folder) -> dict[str, object]:
    text = folder.text("public/search/index.js")
    found: dict[str, object] = json.loads(text.partition(',"",')[2].rstrip()[:-1])
    return found


def test_an_edit_writes_what_it_is_about_and_nothing_else(folder: Folder) -> None:
    before = index(folder)
    folder.replace("content/lessons/1.7-l7.md", "is number7", "is quaintly number7")
    assert folder.main("build", "--quiet").status == 0
    after = index(folder)
    new = [path for path in after if path not in before and path.endswith(".js")]
    assert len(new) == 3, "the text of the page, the word's shard and spelling"
    assert len(after) == len(before)
    same = {path for path in after if after[path] == before.get(path)}
    assert {path for path in after.keys() - same if path in before} == {"search/index.js"}


def test_what_is_taken_back_is_as_it_was(folder: Folder) -> None:
    before = index(folder)
    folder.replace("content/lessons/1.7-l7.md", "is number7", "is quaintly number7")
    assert folder.main("build", "--quiet").status == 0
    folder.replace("content/lessons/1.7-l7.md", "is quaintly number7", "is number7")
    assert folder.main("build", "--quiet").status == 0
    assert index(folder) == before


def test_every_page_is_listed_in_the_order_of_the_course(folder: Folder) -> None:
    pages = listing(folder)["pages"]
    assert isinstance(pages, list)
    named = [page[3] for page in pages if page[3]]
    assert named == [f"1.{n}" for n in range(1, 71)]
    for page in pages:
        assert (folder.root / "public" / page[0]).is_file()
        assert (folder.root / "public" / "assets" / "search" / f"{page[4]}.js").is_file()


def test_a_store_that_cannot_be_written_is_no_matter(folder: Folder) -> None:
    before = index(folder)
    store = folder.root / ".coursebuild"
    for kind in ("parts", "pages", "summaries"):
        shutil.rmtree(store / kind)
        (store / kind).write_text("in the way")
    lesson = "content/lessons/1.7-l7.md"
    folder.write(lesson, folder.text(lesson) + "\n")
    assert folder.main("build", "--quiet").status == 0
    assert index(folder) == before
