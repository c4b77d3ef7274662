"""What somebody changes in a site, or in the folder of the site before last, is not published."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from support.published_sites import MANY, SPARE, TEXTS, Pages, beside, texts
from support.published_sites import pages as pages
from support.published_sites import root as root
from support.published_sites import spared as spared


def edit(file: Path) -> None:
    """In place, as long as it was: the site has the same file."""
    before = file.stat()
    with file.open("r+") as opened:
        opened.write("b/X")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def lengthen(file: Path) -> None:
    before = file.stat()
    with file.open("a") as opened:
        opened.write("!")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def other(file: Path) -> None:
    """Another file with the size and time of this one."""
    before = file.stat()
    file.with_name("other").write_text("b/X.html 1")
    file.with_name("other").replace(file)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def link(file: Path) -> None:
    file.rename(file.with_name("elsewhere"))
    file.symlink_to("elsewhere")


def folder(file: Path) -> None:
    file.unlink()
    file.mkdir()
    (file / "x").write_text("x")


def pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def more(file: Path) -> None:
    file.with_name("more").write_text("more")
    (file.parent / ".DS_Store").write_text("more")
    (file.parent / "empty/empty").mkdir(parents=True)


def no_folder(file: Path) -> None:
    shutil.rmtree(file.parent)


def file_for_folder(file: Path) -> None:
    shutil.rmtree(file.parent)
    file.parent.write_text("x")


def rights(file: Path) -> None:
    file.parent.chmod(0o500)


BY_HAND = [edit, lengthen, other, link, folder, pipe, more, no_folder, file_for_folder, rights]


@pytest.mark.parametrize("change", [*BY_HAND, Path.unlink])
@pytest.mark.parametrize("where", [SPARE, "public"])
def test_changes_by_hand(
    spared: Path, pages: Pages, change: Callable[[Path], None], where: str
) -> None:
    out = spared / "public"
    change(spared / where / "b/c.html")
    for path in out.rglob("*"):  # what nobody may have there by the rules of publishing
        if path.name in ("more", "x", "other", "elsewhere") or (
            path.is_file() and path.name == "b"
        ):
            path.unlink()
    publish(spared, out, pages(**MANY | {"a": "2"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 2"}
    assert not any(p.is_symlink() or p.is_fifo() for p in out.rglob("*"))
    assert {p.stat().st_mode & 0o777 for p in out.rglob("*") if p.is_dir()} == {0o755}
    assert not (out / "b/empty").exists()
    assert (out / "b/c.html").read_text() == "b/c.html 1"
    publish(spared, out, pages(**MANY | {"a": "3"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 3"}
    assert beside(spared) == ["content", "public"]


def test_what_is_unlinked_in_the_spare_stays_in_the_site(spared: Path, pages: Pages) -> None:
    with (spared / "public/b/c.html").open() as opened:
        publish(spared, spared / "public", pages(**MANY | {"b__c": "2"}))
        publish(spared, spared / "public", pages(**MANY | {"b__c": "3"}))
        assert opened.read() == "b/c.html 1"


@pytest.mark.parametrize("where", ["b", "e/f", "new"])
def test_a_link_to_a_folder_leads_nowhere(
    spared: Path, tmp_path: Path, pages: Pages, where: str
) -> None:
    """What it leads to is neither removed nor published, even if it is as the site should be."""
    elsewhere = tmp_path / "elsewhere"
    shutil.move(spared / SPARE / where, elsewhere) if where != "new" else elsewhere.mkdir()
    (elsewhere / "mine").write_text("mine")
    before = texts(elsewhere)
    (spared / SPARE / where).symlink_to(elsewhere)
    publish(spared, spared / "public", pages(**MANY | {"a": "2"}))
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 2"}
    assert not any(p.is_symlink() for p in (spared / "public").rglob("*"))
    assert texts(elsewhere) == before


@pytest.mark.parametrize("what", ["a link", "a file", "empty", "of another site"])
def test_something_else_for_a_spare(spared: Path, tmp_path: Path, pages: Pages, what: str) -> None:
    spare, elsewhere = spared / SPARE, tmp_path / "elsewhere"
    spare.rename(elsewhere)
    if what == "a link":
        spare.symlink_to(elsewhere)
    elif what == "a file":
        spare.write_text("x")
    else:
        spare.mkdir()
        if what == "of another site":
            (spare / "b").write_text("x")
            (spare / "a.html").mkdir()
            (spare / MARKER).write_text("x")
    before = texts(elsewhere)
    for key in "23":
        assert publish(spared, spared / "public", pages(**MANY | {"a": key})) == ("a.html",)
        assert texts(spared / "public") == TEXTS | {"a.html": f"a.html {key}"}
    assert texts(elsewhere) == before
    assert beside(spared) == ["content", "public"]
