"""Publishing again: a whole file with the same key is not made a second time."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from coursebuild.core.model.results import OutputFile
from support.published_sites import Pages, texts
from support.published_sites import pages as pages
from support.published_sites import root as root


def test_where_nothing_differs_the_site_stays(root: Path, pages: Pages) -> None:
    out = root / "public"
    files = [*pages(a="1"), OutputFile("x.css", b"x")]
    publish(root, out, files)
    before = out.stat().st_ino
    assert publish(root, out, files) == ()
    assert out.stat().st_ino == before
    assert publish(root, out, [*pages(a="1"), OutputFile("x.css", b"y")]) == ("x.css",)
    assert out.stat().st_ino != before
    assert pages.made_paths == ["a.html"]


def test_a_file_somebody_put_there_by_our_marker_goes(root: Path, pages: Pages) -> None:
    out = root / "public"
    publish(root, out, pages(a="1"))
    (out / "Thumbs.db").write_text("junk of a file manager")
    assert publish(root, out, pages(a="1")) == ()
    (out / MARKER).write_text((out / MARKER).read_text() + "b.html\n")
    (out / "b.html").write_text("listed, so ours")
    assert publish(root, out, pages(a="1")) == ()
    assert texts(out) == {"a.html": "a.html 1"}


def test_a_damaged_record_is_not_believed(root: Path, pages: Pages) -> None:
    out = root / "public"
    publish(root, out, pages(a="1", b="1"))
    [record] = (p for p in (root / ".coursebuild/published").iterdir() if p.is_file())
    for position in range(0, 200, 7):
        data = bytearray(record.read_bytes())
        data[position % len(data)] ^= 1
        for damaged in (data, data[: position % len(data)], b"\xff" * 99):
            record.write_bytes(damaged)
            paths = publish(root, out, pages(a="1", b="1"))
            assert paths == ("a.html", "b.html"), position


def test_a_project_that_moves_keeps_its_site_and_a_copy_makes_it_again(
    root: Path, tmp_path: Path, pages: Pages
) -> None:
    """The files of a copy have other inodes, so the manifest does not know them."""
    publish(root, root / "public", pages(a="1"))
    new_root, copy = root.rename(tmp_path / "moved"), tmp_path / "copy"
    assert publish(new_root, new_root / "public", pages(a="1")) == ()
    assert pages.made_paths == ["a.html"]
    shutil.copytree(new_root, copy)
    assert publish(copy, copy / "public", pages(a="1")) == ("a.html",)


def test_two_places_have_a_record_each(root: Path, tmp_path: Path, pages: Pages) -> None:
    for out in (root / "public", root / "other", tmp_path / "outside"):
        assert publish(root, out, pages(a="1")) == ("a.html",)
    for out in (root / "public", root / "other", tmp_path / "outside"):
        assert publish(root, out, pages(a="1")) == ()


def test_a_file_changed_while_it_is_linked_is_made_again(
    root: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(root, root / "public", pages(a="1", b="1"))
    really = os.link

    def late(source: str, target: str, *, follow_symlinks: bool = True) -> None:
        really(source, target, follow_symlinks=follow_symlinks)
        Path(source).write_text("changed")

    monkeypatch.setattr(os, "link", late)
    assert publish(root, root / "public", pages(a="1", b="2")) == ("a.html", "b.html")
    assert texts(root / "public") == {"a.html": "a.html 1", "b.html": "b.html 2"}


def test_a_record_that_cannot_be_written_costs_only_time(
    root: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", "/dev/null")
    for _ in range(2):
        assert publish(root, root / "public", pages(a="1")) == ("a.html",)
    assert texts(root / "public") == {"a.html": "a.html 1"}
