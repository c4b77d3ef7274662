"""A site is made anew beside the old one, of which it keeps what did not change."""

from __future__ import annotations

import errno
import os
import random
import shutil
import signal
from pathlib import Path

import pytest

from coursebuild.core.engine import publish as publishing
from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from support.published_sites import SITE_FILES, TEXTS, Pages, entries, texts
from support.published_sites import course as course
from support.published_sites import pages as pages
from support.published_sites import root as root


def test_what_did_not_change_is_not_made(course: Path, pages: Pages) -> None:
    inode = (course / "public/a.html").stat().st_ino
    for key in "23":
        changed = pages(**SITE_FILES | {"b__d": key})
        assert publish(course, course / "public", changed) == ("b/d.html",)
        assert texts(course / "public") == TEXTS | {"b/d.html": f"b/d.html {key}"}
    assert (course / "public/a.html").stat().st_ino == inode
    assert pages.made_paths == ["b/d.html", "b/d.html"]
    assert entries(course) == ["content", "public"]


@pytest.mark.site
@pytest.mark.parametrize("way", ["exchange", "two renames"])
def test_a_long_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    """Edit after edit the site is what it should be, and only what changed is made."""
    chance = random.Random(7)
    if way == "two renames":
        monkeypatch.setattr(publishing, "exchange", lambda a, b: False)
    site = dict.fromkeys(["a", "b", "c/a", "c/b", "c/d/a", "c/d/b", "d/a", "é/a"], "0")
    before: dict[str, str] = {}
    for _ in range(60):
        pages = Pages()
        paths = publish(tmp_path, tmp_path / "public", [pages.page(*item) for item in site.items()])
        assert sorted(paths) == sorted(pages.made_paths)
        assert set(paths) == {path for path, key in site.items() if before.get(path) != key}
        assert texts(tmp_path / "public") == {path: f"{path} {key}" for path, key in site.items()}
        assert (tmp_path / "public" / MARKER).read_text().split("\n")[1:-1] == sorted(site)
        assert all(any(p.iterdir()) for p in (tmp_path / "public").rglob("*") if p.is_dir())
        before = dict(site)
        for name in chance.sample(sorted(site), chance.choice([0, 1, 1, 2])):
            if chance.random() < 0.3 and len(site) > 4:
                del site[name]
            else:
                site[name] = str(chance.randrange(4))


def test_a_failure_while_a_page_is_made_leaves_the_old_site(course: Path, pages: Pages) -> None:
    def broken() -> bytes:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        publish(
            course,
            course / "public",
            [*pages(**SITE_FILES), CachedFile("x.html", "2", broken)],
        )
    assert texts(course / "public") == TEXTS
    assert entries(course) == ["content", "public"]
    assert publish(course, course / "public", pages(**SITE_FILES | {"a": "2"})) == ("a.html",)


@pytest.mark.parametrize("removes", [True, False])
def test_somebody_changes_the_folder_that_is_written(course: Path, removes: bool) -> None:
    def make() -> bytes:
        slot = course / ".public.coursebuild-new"
        if removes:
            (slot / "b/c.html").unlink()
        else:
            (slot / "b/more.html").write_text("more")
        return b"new"

    pages = Pages()
    with pytest.raises(EffectError, match="another process is changing what is being written"):
        publish(course, course / "public", [*pages(**SITE_FILES), CachedFile("x.html", "1", make)])
    assert texts(course / "public") == TEXTS
    assert entries(course) == ["content", "public"]
    publish(
        course,
        course / "public",
        [*pages(**SITE_FILES), CachedFile("x.html", "2", lambda: b"new")],
    )
    assert texts(course / "public") == TEXTS | {"x.html": "new"}


def test_a_site_that_may_only_be_read_leaves_nothing_beside_it(held_back: Path) -> None:
    out, pages = held_back / "public", Pages()
    publish(held_back, out, pages(**SITE_FILES))
    out.chmod(0o555)
    for number in range(2, 5):
        publish(held_back, out, pages(**SITE_FILES | {"a": str(number)}))
        assert entries(held_back) == ["public"]
        assert texts(out) == TEXTS | {"a.html": f"a.html {number}"}
        assert out.stat().st_mode & 0o777 == 0o555
    assert pages.made_paths[len(SITE_FILES) :] == ["a.html"] * 3
    out.chmod(0o755)


@pytest.mark.site
def test_many_files_are_written_as_by_one_process_whatever_becomes_of_the_others(
    tmp_path: Path,
) -> None:
    main_process = os.getpid()

    def die() -> bytes:
        if os.getpid() != main_process:
            os.kill(os.getpid(), signal.SIGKILL)
        return b"written in the end"

    def files(last: bytes) -> list[SiteFile]:
        entries: list[SiteFile] = [OutputFile(f"a/{n}", b"%d" % n) for n in range(150)]
        entries += [CachedFile(f"b/{n}", "k", lambda n=n: b"%d" % n * n) for n in range(150)]
        entries += [CachedFile(f"died {n}", "k", die) for n in range(2)]
        return [*entries, OutputFile("last", last)]

    for jobs in (1, 3):
        (tmp_path / str(jobs)).mkdir()
        publish(tmp_path / str(jobs), tmp_path / str(jobs) / "public", files(b"x"), jobs=jobs)
    assert texts(tmp_path / "1/public") == texts(tmp_path / "3/public")
    assert publish(tmp_path / "3", tmp_path / "3/public", files(b"y"), jobs=3) == ("last",)

    def full() -> bytes:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    failing: list[SiteFile] = [CachedFile(f"c/{n}", "k", full) for n in range(150)]
    with pytest.raises(EffectError, match="no space left"):
        publish(tmp_path / "3", tmp_path / "3/public", [*files(b"z"), *failing], jobs=3)
    assert (tmp_path / "3/public/last").read_bytes() == b"y"


BY_HAND = (
    "edited longer replaced unlinked linked folder pipe more no-folder file-for-folder read-only"
).split()


def change_by_hand(file: Path, kind: str) -> None:
    before = file.stat()
    times = before.st_atime_ns, before.st_mtime_ns
    match kind:
        case "edited":  # in place, without its length: the site holds the same inode
            with file.open("r+") as stream:
                stream.write("b/X")
            os.utime(file, ns=(times[0], times[1] + 1))
        case "longer":
            with file.open("a") as stream:
                stream.write("!")
            os.utime(file, ns=times)
        case "replaced":  # by one of the same size and time
            file.with_name("other").write_text("b/X.html 1")
            file.with_name("other").replace(file)
            os.utime(file, ns=times)
        case "linked":
            file.rename(file.with_name("elsewhere"))
            file.symlink_to("elsewhere")
        case "unlinked" | "folder" | "pipe":
            file.unlink()
            if kind == "folder":
                file.mkdir()
                (file / "x").write_text("x")
            elif kind == "pipe":
                os.mkfifo(file)
        case "more":
            file.with_name("more").write_text("more")
            (file.parent / ".DS_Store").write_text("more")
            (file.parent / "empty/empty").mkdir(parents=True)
        case "no-folder" | "file-for-folder":
            shutil.rmtree(file.parent)
            if kind == "file-for-folder":
                file.parent.write_text("x")
        case "read-only":
            file.parent.chmod(0o500)


@pytest.mark.parametrize("kind", BY_HAND)
def test_changes_by_hand(course: Path, pages: Pages, kind: str) -> None:
    out = course / "public"
    change_by_hand(out / "b/c.html", kind)
    for path in out.rglob("*"):  # foreign files, which publishing would refuse
        if path.name in ("more", "x", "other", "elsewhere") or (
            path.is_file() and path.name == "b"
        ):
            path.unlink()
    publish(course, out, pages(**SITE_FILES | {"a": "2"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 2"}
    assert not any(p.is_symlink() or p.is_fifo() for p in out.rglob("*"))
    assert {p.stat().st_mode & 0o777 for p in out.rglob("*") if p.is_dir()} == {0o755}
    assert not (out / "b/empty").exists()
    assert (out / "b/c.html").read_text() == "b/c.html 1"
    publish(course, out, pages(**SITE_FILES | {"a": "3"}))
    assert texts(out) == TEXTS | {"a.html": "a.html 3"}
    assert entries(course) == ["content", "public"]


@pytest.mark.parametrize("kind", ["a link", "a folder of a killed build"])
def test_something_in_the_place_of_the_new_folder(
    course: Path, tmp_path: Path, pages: Pages, kind: str
) -> None:
    """Nothing of it is published; what a link leads to stays as it is."""
    slot, elsewhere = course / ".public.coursebuild-new", tmp_path / "elsewhere"
    place = elsewhere if kind == "a link" else slot
    (place / "b").mkdir(parents=True)
    (place / "b/x").write_text("x")
    (place / "b").chmod(0o500)
    if kind == "a link":
        slot.symlink_to(elsewhere)
    assert publish(course, course / "public", pages(**SITE_FILES | {"a": "2"})) == ("a.html",)
    assert texts(course / "public") == TEXTS | {"a.html": "a.html 2"}
    assert entries(course) == ["content", "public"]
    assert kind != "a link" or texts(elsewhere) == {"b/x": "x"}
