"""Bytes put aside come back as they were, in the process that has done so and in its copies."""

from __future__ import annotations

import hashlib
import os
import tempfile
import threading
from pathlib import Path
from typing import Never

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.effects.aside import Aside, AsideError, Kept, for_copies
from coursebuild.effects.pool import Pool
from coursebuild.model import Document
from coursebuild.model.blocks import Heading
from coursebuild.pipeline.outlines import pack
from coursebuild.pipeline.shelf import Shelf
from coursebuild.source import Excerpt, Source

TEXTS = ["", "one", "zwei\r\ndrei", "\ufeffπ → 🜁", "x" * 300_000, "\0"]


def test_what_was_put_aside_comes_back(tmp_path: Path) -> None:
    aside = Aside(tmp_path / "kept")
    put = [aside.put(text.encode()) for text in TEXTS]
    for _ in range(2):
        assert [kept.text() for kept in put] == TEXTS
        assert [kept() for kept in reversed(put)] == [text.encode() for text in reversed(TEXTS)]


def test_nothing_is_left_in_the_folder(tmp_path: Path) -> None:
    aside = Aside(tmp_path / "kept")
    kept = aside.put(b"data")
    assert [entry.name for entry in (tmp_path / "kept").iterdir()] == [".gitignore"]
    assert kept() == b"data"


def test_where_nothing_can_be_written_it_stays_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "no space left on device")

    aside = Aside(tmp_path / "kept")
    before = aside.put(b"before")
    monkeypatch.setattr(os, "pwrite", full)
    kept = aside.put("später".encode())
    assert (before(), kept(), kept.text()) == (b"before", "später".encode(), "später")


def test_a_part_of_what_was_put_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    aside = Aside(tmp_path / "kept")
    aside.put(b"before")
    on_disk = aside.put(b"one, two")
    monkeypatch.setattr(aside, "_written", lambda data: False)
    for kept in (on_disk, aside.put(b"one, two")):
        assert kept.part(5, 3)() == b"two"
        assert (kept.part(0, 3).text(), kept.part(3, 0)()) == ("one", b"")


def test_a_disk_that_becomes_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was in the file stays there, what waited and what follows in memory."""
    write = os.pwrite

    def full(fd: int, data: bytes, at: int) -> int:
        if at >= 600_000:
            raise OSError(28, "no space left on device")
        return write(fd, data[:100_000], at)

    aside = Aside(tmp_path / "kept")
    monkeypatch.setattr(os, "pwrite", full)
    parts = [str(n).encode() * 40_000 for n in range(40)]
    put = [aside.put(part) for part in parts]
    assert [kept() for kept in put] == parts
    assert put[0].data is None and put[-1].data == parts[-1]
    assert [kept.part(9, 5)() for kept in put] == [part[9:14] for part in parts]


@pytest.mark.site
@given(st.lists(st.binary(max_size=30), max_size=30), st.data())
def test_any_order_of_putting_and_asking(parts: list[bytes], draw: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        aside = Aside(Path(folder))
        put: list[Kept] = []
        for part in parts:
            put.append(aside.put(part))
            at = draw.draw(st.integers(0, 2 * len(parts)))
            if at < len(put):
                assert put[at]() == parts[at]
        assert [kept() for kept in put] == parts


def test_a_folder_that_is_none_is_no_obstacle(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    kept = Aside(tmp_path / "file").put(b"data")
    assert kept.data is None and kept() == b"data"


def test_a_copy_of_the_process_neither_reads_nor_writes_nor_closes(tmp_path: Path) -> None:
    aside = Aside(tmp_path)
    kept = aside.put(b"data")
    child = os.fork()
    if child == 0:
        status = 1
        try:
            assert not aside.here
            assert aside.put(b"own")() == b"own"
            with pytest.raises(AsideError):
                kept()
            del kept, aside
            status = 0
        finally:
            os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert kept() == b"data" and aside.put(b"more")() == b"more"


def test_copies_that_are_made_for_it_read_what_was_there(tmp_path: Path) -> None:
    aside = Aside(tmp_path)
    put = [aside.put(text.encode()) for text in TEXTS]
    here = os.getpid()

    def read(number: int) -> tuple[str, bool]:
        assert os.getpid() != here
        assert aside.put(b"own")() == b"own" and not aside.here
        return put[number].text(), aside.put(b"own").data is not None

    files, begin = for_copies()
    with Pool(read, 2, begin, files) as pool:
        late = aside.put(b"late")
        answers, _ = pool.run([(None, number) for number in range(len(TEXTS))])
        assert answers == [(text, True) for text in TEXTS]
    assert [kept.text() for kept in put] == TEXTS and late() == b"late"


def test_other_copies_do_not(tmp_path: Path) -> None:
    kept = Aside(tmp_path).put(b"data")
    for_copies()

    def read(number: int) -> bytes:
        return kept()

    with Pool(read, 1) as pool, pytest.raises(AsideError):
        pool.run([(None, 0)])


def test_several_threads(tmp_path: Path) -> None:
    aside = Aside(tmp_path)
    wrong: list[int] = []

    def work(number: int) -> None:
        put = [(f"{number}/{i}" * i, aside.put((f"{number}/{i}" * i).encode())) for i in range(200)]
        wrong.extend(number for text, kept in put if kept.text() != text)

    threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


# --- values whose text or blocks are away


@pytest.mark.parametrize("text", ["", "a\r\nb", "\ufeffπ", "\ud800"])
def test_a_digest_is_that_of_the_text_and_asks_for_none(text: str) -> None:
    def read() -> Never:
        raise AssertionError("nobody needs the text")

    source = Source("a.md", text)
    excerpt = Excerpt(source, text, ((0, 0),))
    expected = hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()
    assert source.digest == excerpt.digest == expected
    assert Source.away("a.md", lambda: text).digest == expected
    assert Excerpt.away(source, lambda: excerpt).digest == expected
    assert Source.away("a.md", read, expected).digest == expected
    assert Excerpt.away(source, read, expected).digest == expected


def test_a_source_that_is_away_is_as_one_that_is_present() -> None:
    text = "# a\r\nb\n\nπ"
    asked: list[int] = []

    def read() -> str:
        asked.append(1)
        return text

    away, present = Source.away("a.md", read), Source("a.md", text)
    assert not asked
    assert away == present and hash(away) == hash(present) and repr(away) == repr(present)
    assert away.line_starts == present.line_starts and away.position(5) == present.position(5)
    assert away.span(1, 4).text == present.span(1, 4).text
    assert away.excerpt() == present.excerpt()
    assert away.present() == present and present.present() is present
    with pytest.raises(AttributeError, match="'Source' object has no attribute 'texts'"):
        away.texts  # type: ignore[attr-defined]  # noqa: B018


def test_an_excerpt_that_is_away_is_as_one_that_is_present() -> None:
    source = Source("a.md", "one\ntwo\n")
    away = Excerpt.away(source, source.excerpt)
    assert away == source.excerpt() and away.is_away and not source.excerpt().is_away
    assert away.lines() == source.excerpt().lines() and away.span(4).text == "two\n"


@pytest.mark.parametrize("room", [0, 1 << 20])
def test_documents_of_a_shelf(tmp_path: Path, room: int) -> None:
    shelf = Shelf(Aside(tmp_path), room)
    made = []
    for n in range(9):
        source = Source(f"{n}.md", f"# {n}\n")
        made.append(Document(source, (Heading(source.span(), 1, (), f"a{n}", False),), ()))
    aside = shelf.aside
    put = [shelf.document(one.source, aside.put(pack(one)), lambda _: made[0]) for one in made]
    assert all(document.is_away for document in put)
    for _ in range(2):
        assert put == made
    source = Source("x.md", "")
    damaged = aside.put(b"damaged")
    assert shelf.document(source, damaged, lambda _: made[3]).blocks == made[3].blocks
