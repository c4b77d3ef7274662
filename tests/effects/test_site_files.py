"""Files of a site written by copies of the process: as by one, whatever becomes of the copies."""

from __future__ import annotations

import hashlib
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.effects import pool, site_files
from coursebuild.effects.published import Entry
from coursebuild.effects.site_files import writing
from coursebuild.results import KeptFile, OutputFile, SiteFile

pytestmark = pytest.mark.site


@pytest.fixture(autouse=True)
def forks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever other tests have imported into this process."""
    monkeypatch.setattr(pool, "can_fork", lambda: True)


def kept(path: str, make: Callable[[], bytes]) -> tuple[SiteFile, str]:
    return KeptFile(path, f"key of {path}", make), f"key of {path}"


def pieces(count: int) -> Iterator[bytes]:
    return (b"%d\n" % n for n in range(count))


def many() -> list[tuple[SiteFile, str]]:
    """Of all kinds: bytes, made, and in pieces."""
    files: list[tuple[SiteFile, str]] = []
    for n in range(80):
        files.append((OutputFile(f"a/{n}", b"%d" % n), f"{n}"))
        files.append(kept(f"b/{n}", lambda n=n: b"made %d" % n * n))  # type: ignore[misc]
        piece = KeptFile(
            f"c/{n}",
            "k",
            lambda: b"",
            lambda n=n: pieces(n * 50),  # type: ignore[misc]
        )
        files.append((piece, "k"))
    return files


def write(folder: Path, files: list[tuple[SiteFile, str]], jobs: int) -> dict[str, Entry]:
    for top in "abc":
        (folder / top).mkdir(parents=True)
    with writing(folder, files, jobs) as written:
        return written()


def tree(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def check(folder: Path, files: list[tuple[SiteFile, str]], entries: dict[str, Entry]) -> None:
    made = tree(folder)
    assert made.keys() == entries.keys() == {file.path for file, _ in files}
    for file, key in files:
        data, status = made[file.path], (folder / file.path).stat()
        assert entries[file.path] == Entry.of(key, hashlib.sha256(data).hexdigest(), status)
        assert status.st_mode & 0o777 == 0o644


def test_copies_write_what_one_process_does(tmp_path: Path) -> None:
    files = many()
    alone = write(tmp_path / "alone", files, 1)
    check(tmp_path / "alone", files, alone)
    together = write(tmp_path / "together", files, 3)
    check(tmp_path / "together", files, together)
    assert tree(tmp_path / "alone") == tree(tmp_path / "together")


@pytest.mark.parametrize("count", [1, 5, 128, 1000, 4321])
def test_every_file_is_in_one_share(count: int) -> None:
    shares = [range(count)[share] for share in site_files._shares(count, 3)]
    assert [number for share in shares for number in share] == list(range(count))
    assert max(map(len, shares)) <= max(count // 12, site_files._FEWEST)
    long = count // 3
    after = [range(count)[share] for share in site_files._shares(count, 3, long)]
    assert [number for share in after for number in share] == list(range(count))
    assert [len(share) for share in after[:long]] == [1] * long


def test_what_is_put_together_of_all_lessons_comes_first(tmp_path: Path) -> None:
    """Else a copy may be at it when the others have no more to do."""
    made: list[str] = []

    def noted(name: str) -> Callable[[], bytes]:
        def make() -> bytes:
            made.append(name)
            (tmp_path / name).write_text(f"{os.getpid()} {len(made)}")
            return b"-"

        return make

    def long() -> Iterator[bytes]:
        yield noted("long")()

    (tmp_path / "site").mkdir()
    files = [kept(f"{n:03}", noted(f"{n:03}")) for n in range(200)]
    files.append((KeptFile("z", "z", lambda: b"", long), "z"))
    with writing(tmp_path / "site", files, 2) as written:
        check(tmp_path / "site", files, written())
    process, number = (tmp_path / "long").read_text().split()
    assert int(process) != os.getpid()
    assert number == "1"  # of all that this copy has made


def test_copies_that_are_killed(tmp_path: Path) -> None:
    """What they have begun is written anew, here."""
    files = many()
    here = os.getpid()

    def die() -> bytes:
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return b"written in the end"

    for n in (3, 90, 200):
        files[n] = kept(f"b/died {n}", die)
    entries = write(tmp_path / "site", files, 2)
    check(tmp_path / "site", files, entries)
    assert (tmp_path / "site/b/died 90").read_bytes() == b"written in the end"


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_file_raises_is_raised(tmp_path: Path, jobs: int) -> None:
    files = many()

    def fail() -> bytes:
        raise OSError(28, "No space left on device")

    files[100] = kept("b/fails", fail)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path / "site", files, jobs)


def test_few_files_are_written_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fork", lambda: pytest.fail("nobody needs a copy"))
    files = many()[: site_files._MANY - 1]
    check(tmp_path / "site", files, write(tmp_path / "site", files, 8))
