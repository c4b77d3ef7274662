"""Bytes put aside come back as they were, in the process that has put them aside and no other."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from coursebuild.effects.aside import Aside, AsideError
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
    put = [shelf.document(document.source, pack(document), lambda: made[0]) for document in made]
    assert all(document.is_away for document in put)
    for _ in range(2):
        assert put == made
    source = Source("x.md", "")
    assert shelf.document(source, b"damaged", lambda: made[3]).blocks == made[3].blocks
