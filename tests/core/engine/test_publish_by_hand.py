"""What somebody changes in a site, or in the folder of the site before last, is not published."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from support.published_sites import SITE_FILES, SPARE, TEXTS, Pages, entries, texts
from support.published_sites import pages as pages
from support.published_sites import root as root
from support.published_sites import spared as spared


def edit(file: Path) -> None:
    """Change a file in place without its length; the site holds the same inode."""
    before = file.stat()
    with file.open("r+") as stream:
        stream.write("b/X")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def lengthen(file: Path) -> None:
    before = file.stat()
    with file.open("a") as stream:
        stream.write("!")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def replace(file: Path) -> None:
    """Put another file of the same size and time in its place."""
    before = file.stat()
    file.with_name("other").write_text("b/X.html 1")
    file.with_name("other").replace(file)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def link(file: Path) -> None:
    file.rename(file.with_name("elsewhere"))
    file.symlink_to("elsewhere")


def make_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()
    (file / "x").write_text("x")


def make_pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def add_files(file: Path) -> None:
    file.with_name("more").write_text("more")
    (file.parent / ".DS_Store").write_text("more")
    (file.parent / "empty/empty").mkdir(parents=True)


def remove_folder(file: Path) -> None:
    shutil.rmtree(file.parent)


def replace_folder_by_file(file: Path) -> None:
    shutil.rmtree(file.parent)
    file.parent.write_text("x")


def make_read_only(file: Path) -> None:
    file.parent.chmod(0o500)


BY_HAND = [
    edit,
    lengthen,
    replace,
    link,
    make_folder,
    make_pipe,
    add_files,
    remove_folder,
    replace_folder_by_file,
    make_read_only,
]


@pytest.mark.parametrize("change", [*BY_HAND, Path.unlink])
@pytest.mark.parametrize("place", [SPARE, "public"])
def test_changes_by_hand(
    spared: Path, pages: Pages, change: Callable[[Path], None], place: str
) -> None:
    out = spared / "public"
    change(spared / place / "b/c.html")
    for path in out.rglob("*"):  # foreign files, which publishing would refuse
        if path.name in ("more", "x", "other", "elsewhere") or (
            path.is_file() and path.name == "b"
        ):
            path.unlink()
    publish(spared, out, pages(**SITE_FILES | {"a": "2"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 2"}
    assert not any(p.is_symlink() or p.is_fifo() for p in out.rglob("*"))
    assert {p.stat().st_mode & 0o777 for p in out.rglob("*") if p.is_dir()} == {0o755}
    assert not (out / "b/empty").exists()
    assert (out / "b/c.html").read_text() == "b/c.html 1"
    publish(spared, out, pages(**SITE_FILES | {"a": "3"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 3"}
    assert entries(spared) == ["content", "public"]


def test_what_is_unlinked_in_the_spare_stays_in_the_site(spared: Path, pages: Pages) -> None:
    with (spared / "public/b/c.html").open() as stream:
        publish(spared, spared / "public", pages(**SITE_FILES | {"b__c": "2"}))
        publish(spared, spared / "public", pages(**SITE_FILES | {"b__c": "3"}))
        assert stream.read() == "b/c.html 1"


@pytest.mark.parametrize("place", ["b", "e/f", "new"])
def test_a_link_to_a_folder_leads_nowhere(
    spared: Path, tmp_path: Path, pages: Pages, place: str
) -> None:
    """Its folder is neither removed nor published, even if it is what a site needs."""
    elsewhere = tmp_path / "elsewhere"
    shutil.move(spared / SPARE / place, elsewhere) if place != "new" else elsewhere.mkdir()
    (elsewhere / "mine").write_text("mine")
    before = texts(elsewhere)
    (spared / SPARE / place).symlink_to(elsewhere)
    publish(spared, spared / "public", pages(**SITE_FILES | {"a": "2"}))
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 2"}
    assert not any(p.is_symlink() for p in (spared / "public").rglob("*"))
    assert texts(elsewhere) == before


@pytest.mark.parametrize("kind", ["a link", "a file", "empty", "of another site"])
def test_something_else_for_a_spare(spared: Path, tmp_path: Path, pages: Pages, kind: str) -> None:
    spare, elsewhere = spared / SPARE, tmp_path / "elsewhere"
    spare.rename(elsewhere)
    if kind == "a link":
        spare.symlink_to(elsewhere)
    elif kind == "a file":
        spare.write_text("x")
    else:
        spare.mkdir()
        if kind == "of another site":
            (spare / "b").write_text("x")
            (spare / "a.html").mkdir()
            (spare / MARKER).write_text("x")
    before = texts(elsewhere)
    for key in "23":
        assert publish(spared, spared / "public", pages(**SITE_FILES | {"a": key})) == ("a.html",)
        assert texts(spared / "public") == TEXTS | {"a.html": f"a.html {key}"}
    assert texts(elsewhere) == before
    assert entries(spared) == ["content", "public"]
