"""The folder of the site before last: it saves work, and is believed as little as the site."""

from __future__ import annotations

import errno
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.effects import locks, site_staging, site_swap
from coursebuild.effects.errors import EffectError
from coursebuild.effects.site_staging import Staging
from coursebuild.effects.site_swap import MARKER, publish, recover
from coursebuild.results import KeptFile
from support.published_sites import MANY, SPARE, TEXTS, Pages, beside, texts
from support.published_sites import links as links
from support.published_sites import pages as pages
from support.published_sites import root as root
from support.published_sites import spared as spared


def test_what_did_not_change_is_neither_made_nor_linked(
    spared: Path, pages: Pages, links: list[str]
) -> None:
    assert publish(spared, spared / "public", pages(**MANY | {"b__d": "2"})) == ("b/d.html",)
    assert links == ["a.html"]  # which changed the time before
    assert texts(spared / "public") == TEXTS | {"b/d.html": "b/d.html 2"}
    assert texts(spared / SPARE) == TEXTS
    assert publish(spared, spared / "public", pages(**MANY | {"b__d": "3"})) == ("b/d.html",)
    assert links == ["a.html"]
    assert pages.made == ["b/d.html", "b/d.html"]
    assert beside(spared) == ["public"]


@pytest.mark.site
def test_a_long_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Edits, with and without a spare: the same files are made, and the same site is there."""
    chance = random.Random(7)
    names = ["a", "b", "c/a", "c/b", "c/d/a", "c/d/b", "d/a", "é/a"]
    sites = [dict.fromkeys(names, "0")]
    for _ in range(60):
        site = dict(sites[-1])
        for name in chance.sample(names, chance.choice([0, 1, 1, 2, 5])):
            if chance.random() < 0.3 and len(site) > 2:
                site.pop(name, None)
            else:
                site[name] = str(chance.randrange(4))
        sites.append(site)

    def history(root: Path) -> list[object]:
        root.mkdir()
        found: list[object] = []
        for site in sites:
            pages = Pages()
            written = publish(root, root / "public", [pages.one(*item) for item in site.items()])
            folders = {p.relative_to(root) for p in (root / "public").rglob("*") if p.is_dir()}
            found.append((written, pages.made, texts(root / "public"), folders))
            assert texts(root / "public") == {path: f"{path} {key}" for path, key in site.items()}
            assert (root / "public" / MARKER).read_text().split("\n")[1:-1] == sorted(site)
        return found

    with_spare = history(tmp_path / "with")
    assert (tmp_path / "with" / SPARE).exists()
    monkeypatch.setattr(site_swap, "keep_spare", lambda *_: None)
    assert history(tmp_path / "without") == with_spare
    assert not (tmp_path / "without" / SPARE).exists()


def test_a_site_with_few_files_of_the_old_one_leaves_no_spare(spared: Path, pages: Pages) -> None:
    publish(spared, spared / "public", pages(**dict.fromkeys(MANY, "2")))
    assert not (spared / SPARE).exists()
    assert beside(spared) == ["public"]


def test_two_places_have_one_spare(spared: Path, pages: Pages) -> None:
    for key in "234":
        for out in ("public", "other"):
            publish(spared, spared / out, pages(**MANY | {"a": key}))
            assert texts(spared / out) == TEXTS | {"a.html": f"a.html {key}"}
    assert beside(spared) == ["other", "public"]


def test_a_spare_that_is_in_use_is_left_alone(spared: Path, pages: Pages) -> None:
    before = texts(spared / SPARE)
    fd = os.open(spared / SPARE, os.O_RDONLY)
    try:
        assert locks.try_lock(fd)
        assert publish(spared, spared / "public", pages(**MANY | {"a": "2"})) == ("a.html",)
        assert texts(spared / SPARE) == before
    finally:
        os.close(fd)
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 2"}
    assert beside(spared) == ["public"]


def test_no_locks_no_spare(spared: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site_staging, "try_lock", lambda fd: None)
    assert Staging.spare(spared, spared / "public") is None
    shutil.rmtree(spared / SPARE)
    publish(spared, spared / "public", pages(**MANY | {"a": "2"}))
    assert not (spared / SPARE).exists()
    assert beside(spared) == ["public"]


def test_no_exchange_no_spare(spared: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site_swap, "exchange", lambda a, b: False)
    for key in "23":
        assert publish(spared, spared / "public", pages(**MANY | {"a": key})) == ("a.html",)
        assert texts(spared / "public") == TEXTS | {"a.html": f"a.html {key}"}
        assert not (spared / SPARE).exists()
    assert beside(spared) == ["public"]


def test_another_file_system_has_no_spare(
    spared: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch
) -> None:
    really = Path.rename

    def rename(path: Path, target: Path) -> Path:
        if (".coursebuild" in path.parts) != (".coursebuild" in target.parts):
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
        return really(path, target)

    monkeypatch.setattr(Path, "rename", rename)
    assert publish(spared, spared / "public", pages(**MANY | {"a": "2"})) == ("a.html",)
    shutil.rmtree(spared / SPARE)
    assert publish(spared, spared / "public", pages(**MANY | {"a": "3"})) == ("a.html",)
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 3"}
    assert not (spared / SPARE).exists()
    assert beside(spared) == ["public"]


@pytest.mark.parametrize("call", ["unlink", "scandir", "fchmod"])
def test_a_spare_that_cannot_be_used(
    spared: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    really = getattr(os, call)
    failed = []

    def fail(*given: object, **named: object) -> object:
        if not failed and (isinstance(given[0], int) or "dir_fd" in named):
            failed.append(given)
            raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))
        return really(*given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail)
        assert publish(spared, spared / "public", pages(**MANY | {"a": "2"})) == ("a.html",)
    assert failed
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 2"}
    assert beside(spared) == ["public"]


def test_a_build_that_is_stopped_in_the_spare(
    spared: Path, pages: Pages, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(site_swap, "sift", stop)
        with pytest.raises(KeyboardInterrupt):
            publish(spared, spared / "public", pages(**MANY | {"a": "2"}))
    assert texts(spared / "public") == TEXTS
    assert beside(spared) == ["public"]


def test_a_failure_while_a_page_is_made_leaves_the_old_site(spared: Path, pages: Pages) -> None:
    def broken() -> bytes:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        publish(spared, spared / "public", [*pages(**MANY), KeptFile("x.html", "2", broken)])
    assert texts(spared / "public") == TEXTS
    assert beside(spared) == ["public"]
    assert publish(spared, spared / "public", pages(**MANY | {"a": "2"})) == ("a.html",)


@pytest.mark.parametrize("removes", [True, False])
def test_somebody_changes_the_folder_that_is_written(spared: Path, removes: bool) -> None:
    """As one does who was removing the spare when it was taken."""

    def make() -> bytes:
        [staging] = spared.glob(".public.new-*")
        if removes:
            (staging / "b/c.html").unlink()
        else:
            (staging / "b/more.html").write_text("more")
        return b"new"

    pages = Pages()
    with pytest.raises(EffectError, match="somebody else changes what is being written"):
        publish(spared, spared / "public", [*pages(**MANY), KeptFile("x.html", "1", make)])
    assert texts(spared / "public") == TEXTS
    assert beside(spared) == ["public"]
    publish(spared, spared / "public", [*pages(**MANY), KeptFile("x.html", "2", lambda: b"new")])
    assert texts(spared / "public") == TEXTS | {"x.html": "new"}


def test_the_site_that_another_build_put_there_is_no_spare(spared: Path, pages: Pages) -> None:
    """Only what was held when it was at the place is kept: nobody is removing that."""
    with site_staging.held(spared / "public") as fd:
        assert fd is not None
        (spared / ".public.new-0123abcd").mkdir()
        shutil.rmtree(spared / SPARE)
        site_staging.keep_spare(spared, spared / ".public.new-0123abcd", fd)
    assert not (spared / SPARE).exists()
    publish(spared, spared / "public", pages(**MANY | {"a": "2"}))
    assert beside(spared) == ["public"]


def test_permissions_of_the_folder_are_those_of_the_site(spared: Path, pages: Pages) -> None:
    (spared / "public").chmod(0o750)
    publish(spared, spared / "public", pages(**MANY | {"a": "2"}))
    assert (spared / "public").stat().st_mode & 0o777 == 0o750


BUILD = """
import itertools, sys
from pathlib import Path
from coursebuild.effects import site_swap
from coursebuild.results import KeptFile
root, name = Path(sys.argv[1]), sys.argv[2]
enough = root.parent / "enough"
def page(path, key):
    return KeptFile(path, key, lambda: f"{path} {key}".encode())
for i in itertools.count():
    if i >= 60 and enough.exists():
        break
    own = [page(f"own/{k}.html", f"{name}{i}") for k in range(3)]
    site_swap.publish(root, root / "public", [*own, *(page(f"{k}/x.html", "1") for k in range(20))])
"""


@pytest.mark.site
def test_two_builds_at_once(root: Path, pages: Pages) -> None:
    """They hold no lock of the project, and take the spare from each other."""
    builds = [
        subprocess.Popen(
            [sys.executable, "-c", BUILD, str(root), name],
            cwd=Path(locks.__file__).parents[2],
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in ("a", "b")
    ]
    seen: set[str] = set()
    while any(build.poll() is None for build in builds):
        if (root / "public").exists() or seen:
            assert (root / "public/7/x.html").read_text() == "7/x.html 1"
            seen.add((root / "public/own/0.html").read_text())
        if len(seen) > 2:
            (root.parent / "enough").touch()
    assert all(text.startswith("own/0.html ") and text[-1].isdigit() for text in seen)
    said = [build.communicate(timeout=600)[1] for build in builds]
    assert [build.returncode for build in builds] == [0, 0], "".join(said)
    there = texts(root / "public")
    assert len(there) == 23
    assert len({there[f"own/{k}.html"].partition(" ")[2] for k in range(3)}) == 1
    publish(root, root / "public", pages(**MANY))
    assert beside(root) == ["public"]


def test_killed_after_the_spare_was_taken(spared: Path, pages: Pages) -> None:
    taken = Staging.spare(spared, spared / "public")
    assert taken is not None
    os.close(taken.fd)
    recover(spared / "public")
    assert publish(spared, spared / "public", pages(**MANY | {"a": "2"})) == ("a.html",)
    assert texts(spared / "public") == TEXTS | {"a.html": "a.html 2"}
    assert beside(spared) == ["public"]


def test_a_site_that_may_only_be_read_leaves_nothing_beside_it(held_back: Path) -> None:
    out, pages = held_back / "public", Pages()
    publish(held_back, out, pages(**MANY))
    out.chmod(0o555)
    for number in range(2, 5):
        publish(held_back, out, pages(**MANY | {"a": str(number)}))
        assert beside(held_back) == ["public"]
        assert texts(out) == TEXTS | {"a.html": f"a.html {number}"}
        assert (held_back / SPARE).is_dir()
        assert out.stat().st_mode & 0o777 == 0o555
    assert pages.made[len(MANY) :] == ["a.html"] * 3
    out.chmod(0o755)
