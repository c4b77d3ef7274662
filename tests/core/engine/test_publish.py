"""Publishing: the whole site or the old one, never over what is not ours, no whole file twice."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from coursebuild.core.engine import publish as publishing
from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import exchange, publish
from coursebuild.core.files.errors import EffectError, PublishRefusedError
from coursebuild.core.model.results import OutputFile
from support.published_sites import Pages, entries, texts
from support.published_sites import pages as pages
from support.published_sites import root as root
from support.run_code import program

PATHS = ("index.html", "404.html", "lessons/4.2/index.html", "assets/fonts/a b é.woff2")


def site(text: str) -> list[OutputFile]:
    return [OutputFile(path, f"{text} {path}".encode()) for path in PATHS]


def site_texts(text: str) -> dict[str, str]:
    return {path: f"{text} {path}" for path in PATHS}


@pytest.fixture(params=[True, False], ids=["exchange", "two renames"])
def exchanges(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    if not request.param:
        monkeypatch.setattr(publishing, "exchange", lambda a, b: False)
    return bool(request.param)


def test_this_system_exchanges_in_one_step(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / name).touch()
    assert exchange(tmp_path / "a", tmp_path / "b")
    assert (tmp_path / "a/b").exists() and (tmp_path / "b/a").exists()
    with pytest.raises(FileNotFoundError):
        exchange(tmp_path / "a", tmp_path / "none")


def test_same_bytes_and_permissions_whatever_the_umask(root: Path) -> None:
    old = os.umask(0o077)
    try:
        publish(root, root / "public", site("one"))
    finally:
        os.umask(old)
    for path in (root / "public", *(root / "public").rglob("*")):
        assert stat.S_IMODE(path.stat().st_mode) == (0o755 if path.is_dir() else 0o644)
    publish(root, root / "a/b/again", site("one"))
    assert (root / "a/b/again" / MARKER).read_bytes() == (root / "public" / MARKER).read_bytes()


def test_link_that_leads_out_of_the_project_is_not_followed(root: Path, tmp_path: Path) -> None:
    """A course may bring it along, to a folder where another site of ours is."""
    publish(root, tmp_path / "www", site("one"))
    (root / "public").symlink_to(tmp_path / "www")
    with pytest.raises(PublishRefusedError, match=r"is a link that leads out of the project$"):
        publish(root, root / "public", site("two"))
    assert texts(tmp_path / "www") == site_texts("one")


def test_folder_keeps_its_permissions_and_a_link_its_place(root: Path, tmp_path: Path) -> None:
    (root / "www").mkdir()
    (root / "www").chmod(0o2775)
    (root / "public").symlink_to(root / "www")
    for text in ("one", "two"):
        publish(root, root / "public", site(text))
        assert (root / "public").is_symlink()
        assert stat.S_IMODE((root / "www").stat().st_mode) == 0o2775
        assert texts(root / "www") == site_texts(text)
    assert entries(tmp_path) == ["course"]


def test_paths_that_no_site_has_or_that_are_in_each_others_way(root: Path) -> None:
    publish(root, root / "public", site("one"))
    bad = ("", "/a", "../a", "a/../b", "a//b", "./a", "a/", "a\\b", "a\nb", "a\0b", MARKER)
    for path in bad:
        with pytest.raises(ValueError, match="is not a path that a site may have"):
            publish(root, root / "public", [OutputFile("a.html", b""), OutputFile(path, b"")])
    for paths in (("a", "a"), ("a", "a/b"), ("a/b", "a")):
        with pytest.raises((ValueError, EffectError)):
            publish(root, root / "public", [OutputFile(path, b"") for path in paths])
    assert texts(root / "public") == site_texts("one")
    assert entries(root) == ["content", "public"]


@pytest.mark.site
def test_every_instant_has_a_whole_site(root: Path, exchanges: bool) -> None:
    """A reader finds a whole page at any time while it is published over and over."""
    out = root / "public"
    publish(root, out, site("0"))
    stop = threading.Event()
    texts_seen: set[str | None] = set()

    def read() -> None:
        while not stop.is_set():
            try:
                texts_seen.add((out / "index.html").read_text())
            except FileNotFoundError:
                texts_seen.add(None)

    reader = threading.Thread(target=read)
    reader.start()
    for i in range(60):
        publish(root, out, site(str(i % 7)))
        while not texts_seen and reader.is_alive():
            time.sleep(0.001)
    publish(root, out, site("last"))
    while "last index.html" not in texts_seen and reader.is_alive():
        time.sleep(0.001)
    stop.set()
    reader.join()
    # Without an exchange there is an instant between two renames, and nothing can be done.
    expected = {f"{i} index.html" for i in (*range(7), "last")}
    assert texts_seen <= (expected if exchanges else {*expected, None})


# --- places where no site goes


def refusal(root: Path, out: Path) -> str:
    """The reason why a place is refused; nothing there changes."""
    before = texts(root.parent)
    with pytest.raises(PublishRefusedError) as caught:
        publish(root, out, site("one"))
    assert texts(root.parent) == before
    return caught.value.message.removeprefix(f"{out} ")


AUTHOR_PATHS = """
content content/lessons/out content/course.toml models/x examples .git/x .coursebuild/x
""".split()


def test_places_of_the_author_are_refused(root: Path) -> None:
    for name in (".", "..", "../..", "/"):
        reason = "is the project itself" if name == "." else "holds the project"
        assert refusal(root, root / name) == reason
    (root / "link").symlink_to("content")
    inside = {name: name.partition("/")[0] for name in AUTHOR_PATHS}
    for name, folder in (inside | {"public/../models": "models", "link": "content"}).items():
        reason = f"lies in {folder}/ of the project, which cannot hold a site"
        assert refusal(root, root / name) == reason


def test_files_of_somebody_are_never_published_over(root: Path, tmp_path: Path) -> None:
    (root / "file").write_text("mine")
    assert refusal(root, root / "file") == "is not a folder"
    for i in range(5):
        (tmp_path / "home" / str(i)).mkdir(parents=True)
        (tmp_path / "home" / str(i) / "thesis.tex").write_text("mine")
    foreign = "holds files that coursebuild did not put there: "
    three = "0/thesis.tex, 1/thesis.tex, 2/thesis.tex and 2 more"
    assert refusal(root, tmp_path / "home") == foreign + three
    publish(root, root / "public", site("one"))
    (root / "public/lessons/CNAME").write_text("mine")
    assert refusal(root, root / "public") == f"{foreign}lessons/CNAME"
    for marker in (b"", b"something else\nindex.html\n", b"\xff"):
        (root / "public" / MARKER).write_bytes(marker)
        assert refusal(root, root / "public").startswith(foreign)


def test_a_folder_that_no_build_has_renamed_away_does_not_become_the_site(root: Path) -> None:
    foreign = root / ".public.coursebuild-old"
    foreign.mkdir()
    (foreign / "thesis.tex").write_text("mine")
    publish(root, root / "public", site("one"))
    assert texts(root / "public") == site_texts("one")


def test_a_mount_point_is_refused(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (root / "public").mkdir()
    monkeypatch.setattr(os.path, "ismount", lambda path: path.name == "public")
    assert refusal(root, root / "public") == "is a mount point, which cannot be swapped"


@pytest.mark.site
def test_two_builds_at_once(root: Path, exchanges: bool) -> None:
    builds = [
        subprocess.Popen(
            [sys.executable, "-c", program("publish_often"), str(root), name, str(exchanges)],
            cwd=Path(publishing.__file__).parents[3],
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in ("a", "b")
    ]
    errors = [build.communicate(timeout=600)[1] for build in builds]
    assert [build.returncode for build in builds] == [0, 0], "".join(errors)
    assert len(set(texts(root / "public").values())) == 1
    assert len(texts(root / "public")) == 20
    publish(root, root / "public", site("one"))
    assert entries(root) == ["content", "public"]


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
