"""Files put together of pieces of the ones before them: the same bytes, with less made."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.effects.site_swap import publish
from coursebuild.effects.splicing import Earlier, Spliced
from coursebuild.results import KeptFile, Piece, made

PARTS = st.lists(st.tuples(st.sampled_from(["", *"abcdefgh"]), st.binary(max_size=20)), max_size=12)


class Pieces:
    """Pieces, and which of them were made and seen."""

    def __init__(self, parts: Sequence[tuple[str, bytes]]) -> None:
        """One without a key is just bytes."""
        self.parts = parts
        self.made: list[str] = []
        self.seen: list[bytes] = []

    def all(self) -> list[bytes | Piece]:
        return [
            Piece(key, self._make(key, data), self.seen.append) if key else data
            for key, data in self.parts
        ]

    @property
    def whole(self) -> bytes:
        return b"".join(data for _, data in self.parts)

    def _make(self, key: str, data: bytes) -> Callable[[], bytes]:
        def make() -> bytes:
            self.made.append(key)
            return data

        return make


def meaning(parts: Sequence[tuple[str, bytes]], known: dict[str, bytes]) -> Pieces:
    """Pieces whose keys say what they are: one that has come before has its bytes."""
    return Pieces([(key, known.setdefault(key, data) if key else data) for key, data in parts])


@given(old=PARTS, new=PARTS, damaged=st.none() | st.integers(0, 300), cut=st.integers(0, 300))
def test_the_file_is_that_of_pieces_that_are_all_made(
    tmp_path_factory: pytest.TempPathFactory,
    old: list[tuple[str, bytes]],
    new: list[tuple[str, bytes]],
    damaged: int | None,
    cut: int,
) -> None:
    known: dict[str, bytes] = {}
    first, second = meaning(old, known), meaning(new, known)
    spliced = Spliced(None)
    data = b"".join(spliced.pieces(first.all()))
    assert data == first.whole == b"".join(made(Pieces(first.parts).all()))
    assert first.made == [key for key, _ in first.parts if key]
    if damaged is not None and data:
        at = damaged % len(data)
        data = (data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])[: cut or None]
    path = tmp_path_factory.mktemp("spliced") / "file"
    path.write_bytes(data)
    fd = os.open(path, os.O_RDONLY)
    try:
        earlier = Earlier(fd, spliced.places) if spliced.places else None
        again = Spliced(earlier)
        assert b"".join(again.pieces(second.all())) == second.whole
    finally:
        os.close(fd)
    assert second.seen == [data for key, data in second.parts if key]
    if damaged is None:
        had = {key for key, _ in first.parts}
        assert second.made == [key for key, _ in second.parts if key and key not in had]
    assert " " not in again.places and "\n" not in again.places


def page(pieces: Pieces, key: str) -> KeptFile:
    return KeptFile("course/index.html", key, lambda: b"", pieces.all)


LESSONS = [("", b"<top>"), ("k1", b"one "), ("k2", b"two "), ("k3", b"three "), ("", b"<end>")]
EDITED = [*LESSONS[:2], ("k4", b"another "), *LESSONS[3:]]


def published(root: Path, parts: Sequence[tuple[str, bytes]], key: str) -> list[str]:
    """Publishes a page of these; gives what was made."""
    pieces = Pieces(parts)
    publish(root, root / "public", [page(pieces, key)])
    assert (root / "public" / "course" / "index.html").read_bytes() == pieces.whole
    return pieces.made


def test_only_the_piece_that_is_another_is_made(tmp_path: Path) -> None:
    assert published(tmp_path, LESSONS, "1") == ["k1", "k2", "k3"]
    assert published(tmp_path, EDITED, "2") == ["k4"]
    assert published(tmp_path, EDITED, "2") == []
    assert published(tmp_path, LESSONS, "3") == ["k2"]
    assert published(tmp_path, [], "4") == []
    assert published(tmp_path, LESSONS, "5") == ["k1", "k2", "k3"]


def test_a_file_that_was_linked_gives_its_pieces_too(tmp_path: Path) -> None:
    published(tmp_path, LESSONS, "1")
    other = KeptFile("other.html", "1", lambda: b"other")
    publish(tmp_path, tmp_path / "public", [page(Pieces(LESSONS), "1"), other])
    assert published(tmp_path, EDITED, "2") == ["k4"]


@pytest.mark.parametrize("kept_times", [False, True])
@pytest.mark.parametrize("change", [b"<top>one TWO three <end>", b"", b"<top>one two three <end>."])
def test_what_somebody_has_changed_is_made_anew(
    tmp_path: Path, change: bytes, kept_times: bool
) -> None:
    published(tmp_path, LESSONS, "1")
    path = tmp_path / "public" / "course" / "index.html"
    status = path.stat()
    path.write_bytes(change)
    if kept_times:
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    made_now = published(tmp_path, [*LESSONS[:1], *LESSONS[2:]], "2")
    whole = len(change) == status.st_size and kept_times
    assert made_now == (["k2"] if whole else ["k2", "k3"])


def test_a_pipe_that_somebody_put_there_is_not_waited_for(tmp_path: Path) -> None:
    published(tmp_path, LESSONS, "1")
    path = tmp_path / "public" / "course" / "index.html"
    path.unlink()
    os.mkfifo(path)
    assert published(tmp_path, EDITED, "2") == ["k1", "k4", "k3"]


def test_a_file_that_is_gone_or_a_link_now(tmp_path: Path) -> None:
    published(tmp_path, LESSONS, "1")
    path = tmp_path / "public" / "course" / "index.html"
    path.unlink()
    assert published(tmp_path, LESSONS, "2") == ["k1", "k2", "k3"]
    path.unlink()
    path.symlink_to(tmp_path / "public" / ".coursebuild-site")
    assert published(tmp_path, EDITED, "3") == ["k1", "k4", "k3"]
