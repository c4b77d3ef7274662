"""Publishing: the whole site or the old one, and never over what is not ours."""

from __future__ import annotations

import errno
import os
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


def site(text: str, *more: str) -> list[OutputFile]:
    paths = ("index.html", "404.html", "lessons/4.2/index.html", "assets/fonts/a b é.woff2", *more)
    return [OutputFile(path, f"{text} {path}".encode()) for path in paths]


def tree(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes()
        for p in folder.rglob("*")
        if p.is_file() and p.name != MARKER
    }


def names(folder: Path) -> list[str]:
    """What lies in a folder, but for the tool's own."""
    return sorted(p.name for p in folder.iterdir() if p.name != ".coursebuild")


def as_tree(files: list[OutputFile]) -> dict[str, bytes]:
    return {f.path: f.data for f in files}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    (root / "content/lessons").mkdir(parents=True)
    (root / "content/course.toml").write_text("[course]\n")
    (root / "models").mkdir()
    return root


@pytest.fixture(params=[True, False], ids=["exchange", "two renames"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
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


class TestPublish:
    def test_same_bytes_whatever_the_umask(self, root: Path) -> None:
        old = os.umask(0o077)
        try:
            publish(root, root / "public", site("one"))
        finally:
            os.umask(old)
        modes = {
            p.relative_to(root).as_posix(): stat.S_IMODE(p.stat().st_mode)
            for p in (root / "public", *(root / "public").rglob("*"))
        }
        assert set(modes.values()) == {0o755, 0o644}
        assert all((mode == 0o755) == (root / path).is_dir() for path, mode in modes.items())
        publish(root, root / "again", site("one"))
        assert (root / "again" / MARKER).read_bytes() == (root / "public" / MARKER).read_bytes()

    def test_permissions_of_the_folder_stay(self, root: Path) -> None:
        (root / "public").mkdir()
        (root / "public").chmod(0o2775)
        for _ in range(2):
            publish(root, root / "public", site("one"))
            assert stat.S_IMODE((root / "public").stat().st_mode) == 0o2775

    def test_a_link_to_a_folder_stays(self, root: Path, tmp_path: Path) -> None:
        (tmp_path / "www").mkdir()
        (root / "public").symlink_to(tmp_path / "www")
        for text in ("one", "two"):
            publish(root, root / "public", site(text))
            assert (root / "public").is_symlink()
            assert tree(tmp_path / "www") == as_tree(site(text))
        assert names(tmp_path) == ["course", "www"]

    def test_folders_above_are_made(self, root: Path, tmp_path: Path) -> None:
        publish(root, tmp_path / "a/b/c", site("one"))
        assert tree(tmp_path / "a/b/c") == as_tree(site("one"))

    def test_file_managers_may_look(self, root: Path) -> None:
        publish(root, root / "public", site("one"))
        (root / "public/.DS_Store").touch()
        (root / "public/empty").mkdir()
        publish(root, root / "public", site("two"))
        assert tree(root / "public") == as_tree(site("two"))

    @pytest.mark.parametrize("call", ["fchmod", "mkdir"])
    def test_full_disk(self, root: Path, monkeypatch: pytest.MonkeyPatch, call: str) -> None:
        publish(root, root / "public", site("one"))
        really = getattr(os, call)
        calls = 0

        def fail(*arguments: object) -> object:
            nonlocal calls
            calls += 1
            if calls > 2:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return really(*arguments)

        with monkeypatch.context() as patch:
            patch.setattr(os, call, fail)
            with pytest.raises(EffectError, match="no space left on device"):
                publish(root, root / "public", site("two"))
        assert tree(root / "public") == as_tree(site("one"))
        assert names(root) == ["content", "models", "public"]

    def test_paths_that_no_site_has(self, root: Path) -> None:
        publish(root, root / "public", site("one"))
        bad = ("", "/a", "../a", "a/../b", "a//b", "./a", "a/", "a\\b", "a\nb", "a\0b", MARKER)
        for path in bad:
            with pytest.raises(ValueError, match="is no path that a site may have"):
                publish(root, root / "public", [OutputFile("a.html", b""), OutputFile(path, b"")])
            assert tree(root / "public") == as_tree(site("one"))

    def test_files_in_each_others_way(self, root: Path) -> None:
        for paths in (("a", "a"), ("a", "a/b"), ("a/b", "a")):
            with pytest.raises((ValueError, EffectError)):
                publish(root, root / "public", [OutputFile(p, b"") for p in paths])
            assert names(root) == ["content", "models"]

    @pytest.mark.site
    def test_every_instant_has_a_whole_site(self, root: Path, way: bool) -> None:
        """Somebody reads the page all the time while it is published over and over."""
        out = root / "public"
        publish(root, out, site("0"))
        stop = threading.Event()
        seen: set[bytes | None] = set()

        def read() -> None:
            while not stop.is_set():
                try:
                    seen.add((out / "index.html").read_bytes())
                except FileNotFoundError:
                    seen.add(None)

        reader = threading.Thread(target=read)
        reader.start()
        for i in range(60):
            publish(root, out, site(str(i % 7)))
            while not seen and reader.is_alive():
                time.sleep(0.001)
        publish(root, out, site("last"))
        while b"last index.html" not in seen and reader.is_alive():
            time.sleep(0.001)
        stop.set()
        reader.join()
        allowed: set[bytes | None] = {f"{i} index.html".encode() for i in (*range(7), "last")}
        # Without an exchange there is an instant between two renames, and nothing can be done.
        assert seen <= (allowed if way else allowed | {None})


class TestRefusal:
    def refused(self, root: Path, out: Path) -> str:
        before = tree(root.parent)
        with pytest.raises(PublishRefusedError) as caught:
            publish(root, out, site("one"))
        assert tree(root.parent) == before
        return caught.value.message

    def test_places_of_the_author(self, root: Path) -> None:
        for out in (".", "..", "../..", "/"):
            why = "is the project itself" if out == "." else "holds the project"
            assert self.refused(root, root / out) == f"{root / out} {why}"
        authored = ("content", "content/lessons/out", "content/course.toml", "models/x", "examples")
        for out in (*authored, "public/../models", ".git/x", ".coursebuild/x"):
            folder = "models" if out.endswith("models") else out.partition("/")[0]
            why = f"lies in {folder}/ of the project, where no site may go"
            assert self.refused(root, root / out) == f"{root / out} {why}"

    def test_a_link_to_such_a_place(self, root: Path) -> None:
        (root / "public").symlink_to("content")
        assert "lies in content/" in self.refused(root, root / "public")

    def test_a_file(self, root: Path) -> None:
        (root / "public").write_text("mine")
        assert self.refused(root, root / "public") == f"{root / 'public'} is not a folder"

    def test_somebodys_folder(self, root: Path, tmp_path: Path) -> None:
        for i in range(5):
            (tmp_path / "home" / str(i)).mkdir(parents=True)
            (tmp_path / "home" / str(i) / "thesis.tex").write_text("mine")
        assert self.refused(root, tmp_path / "home").endswith(
            "holds files that coursebuild did not put there: "
            "0/thesis.tex, 1/thesis.tex, 2/thesis.tex and 2 more"
        )

    def test_a_site_with_somebodys_file(self, root: Path) -> None:
        publish(root, root / "public", site("one"))
        (root / "public/lessons/CNAME").write_text("mine")
        assert self.refused(root, root / "public").endswith("put there: lessons/CNAME")
        assert tree(root / "public") == as_tree(site("one")) | {"lessons/CNAME": b"mine"}

    def test_a_folder_that_only_looks_like_a_site(self, root: Path) -> None:
        (root / "public").mkdir()
        (root / "public/index.html").write_text("mine")
        for marker in (b"", b"something else\nindex.html\n", b"\xff"):
            (root / "public" / MARKER).write_bytes(marker)
            assert "did not put there" in self.refused(root, root / "public")

    def test_a_mount_point(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (root / "public").mkdir()
        monkeypatch.setattr(os.path, "ismount", lambda path: path.name == "public")
        assert "is a mount point" in self.refused(root, root / "public")


BUILD = """
import sys
from pathlib import Path
from coursebuild.core.engine import publish
from coursebuild.core.model.results import OutputFile
root, name, way = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
if way == "renames":
    publish.exchange = lambda a, b: False
for i in range(40):
    files = [OutputFile(f"{name}{k}/index.html", name.encode()) for k in range(20)]
    publish.publish(root, root / "public", files)
"""


@pytest.mark.site
@pytest.mark.parametrize("way", ["exchange", "renames"])
def test_two_builds_at_once(root: Path, way: str) -> None:
    builds = [
        subprocess.Popen(
            [sys.executable, "-c", BUILD, str(root), name, way],
            cwd=Path(publishing.__file__).parents[3],
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in ("a", "b")
    ]
    said = [build.communicate(timeout=600)[1] for build in builds]
    assert [build.returncode for build in builds] == [0, 0], "".join(said)
    assert len(set(tree(root / "public").values())) == 1
    assert len(tree(root / "public")) == 20
    publish(root, root / "public", site("one"))
    assert names(root) == ["content", "models", "public"]
