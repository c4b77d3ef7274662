"""The files beside pages, Markdown and notebooks, are made anew when needed."""

from __future__ import annotations

import shutil
from collections.abc import Callable

import pytest

from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site

Make = Callable[..., Folder]


def inodes(folder: Folder) -> dict[str, int]:
    public = folder.root / "public"
    return {
        path.relative_to(public).as_posix(): path.stat().st_ino
        for path in public.rglob("*")
        if path.suffix in (".md", ".ipynb", ".txt")
    }


def test_edit_makes_the_copies_of_its_lesson_anew_and_damaged_ones_are_mended(make: Make) -> None:
    folder = make(GOOD, "## Two\n\nText.\n", "## Three\n\nText.\n")
    assert folder.main("build", "--quiet").status == 0
    before = inodes(folder)
    assert {"lessons/1.2-two.md", "lessons/1.2-two.ipynb", "llms.txt"} <= set(before)
    folder.replace(folder.lesson(2), "Text.", "Other text.")
    assert folder.main("build", "--quiet").status == 0
    after = inodes(folder)
    assert before.keys() == after.keys()
    assert {path for path in after if after[path] != before[path]} == {
        "lessons/1.2-two.ipynb",
        "lessons/1.2-two.md",
    }
    assert b"Other text." in folder.read("public/lessons/1.2-two.md")
    whole = folder.tree("public")
    assert folder.spoil() > 10
    shutil.rmtree(folder.root / "public")
    assert folder.main("build", "--quiet").status == 0
    assert folder.tree("public") == whole
