"""Outlines that are kept together are those that are kept one by one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.diagnostics import Diagnostic
from coursebuild.effects import packs
from coursebuild.effects.aside import Aside
from coursebuild.effects.store import Store
from coursebuild.model import Document
from coursebuild.pipeline import documents as module
from coursebuild.pipeline import together
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.outlines import Task
from coursebuild.pipeline.reading import Reader
from coursebuild.pipeline.requests import OUTLINES
from coursebuild.pipeline.together import Together
from coursebuild.source import Source

pytestmark = pytest.mark.site

KINDS = frozenset({"note"})
SCRIPT = "```python file=examples/{n}.py\nprint({n})\n```\n\nOutput:\n\n```text\n{n}\n```\n"
Read = dict[str, tuple[Document, tuple[Diagnostic, ...]]]


def text(n: int, more: str = "") -> Source:
    body = SCRIPT.format(n=n) if n % 3 else "A [link](nowhere) and `raw\n"
    return Source(f"content/lessons/1.{n}.md", f"# {n}\n\n{body}\n{more}")


def texts(count: int = 12) -> list[Source]:
    return [text(n) for n in range(count)]


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The paths of what was read anew."""
    seen: list[str] = []
    before = Reader._read

    def read(self: Reader, task: Task) -> bytes:
        seen.append(task.source.path)
        return before(self, task)

    monkeypatch.setattr(Reader, "_read", read)
    yield seen


def read(root: Path, sources: list[Source], store: Store | None = None) -> Read:
    """All that is known of texts, as a build reads them."""
    store = Store(root) if store is None else store
    with Documents(store, 1, aside=Aside(root)) as documents:
        documents.ahead([(source, True) for source in sources], KINDS)
        found: Read = {}
        for source in sources:
            known = documents.parse(source, KINDS, lesson=True)
            skeleton = known.value
            whole = Document(source, skeleton.blocks, skeleton.footnotes, skeleton.lexicon)
            found[source.path] = whole, known.diagnostics
    store.close()
    return found


def heard(store: Store) -> list[str]:
    lines: list[str] = []
    store.listen(lines.append)
    return lines


def alone(root: Path, sources: list[Source]) -> Read:
    """The same, read as if each was the only text."""
    found: Read = {}
    for source in sources:
        found |= read(root, [source])
    return found


def test_what_is_together_is_what_is_alone(tmp_path: Path, parsed: list[str]) -> None:
    expected = alone(tmp_path / "alone", texts())
    parsed.clear()
    assert read(tmp_path, texts()) == expected
    assert sorted(parsed) == sorted(source.path for source in texts())
    parsed.clear()
    assert read(tmp_path, texts()) == expected and not parsed


def test_of_unchanged_texts_no_entry_is_looked_up(
    tmp_path: Path, parsed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = read(tmp_path, texts())
    parsed.clear()
    changed = [text(0, "more"), *texts()[1:]]
    asked: list[str] = []
    before = Store.peek

    def peek(self: Store, kind: str, key: str, *, packed: bool = True) -> bytes | None:
        if kind == OUTLINES:
            asked.append(key)
        return before(self, kind, key, packed=packed)

    monkeypatch.setattr(Store, "peek", peek)
    found = read(tmp_path, changed)
    assert parsed == [changed[0].path] and asked == [Task.of(changed[0], KINDS, True).key]
    assert {p: found[p] for p in found if p != changed[0].path} == {
        p: expected[p] for p in expected if p != changed[0].path
    }
    parsed.clear()
    assert read(tmp_path, texts()) == expected and not parsed, "what was there before is known"


@pytest.mark.parametrize("change", ["added", "removed", "turned"])
def test_texts_come_and_go(tmp_path: Path, parsed: list[str], change: str) -> None:
    sources = texts()
    read(tmp_path, sources)
    parsed.clear()
    if change == "added":
        sources.insert(0, text(77))
    elif change == "removed":
        del sources[0]
    else:
        sources.reverse()
    assert read(tmp_path, sources) == alone(tmp_path / "alone", sources)
    assert set(parsed[: -len(sources)]) == ({text(77).path} if change == "added" else set())


def test_a_damaged_entry_is_told_and_made_again(
    tmp_path: Path, parsed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_FEW", 1 << 40)
    expected = read(tmp_path, texts())
    parsed.clear()
    name = f"{together._KIND}/{together._name([Task.of(texts()[0], KINDS, True)])}"
    there = Store(tmp_path)._packs
    assert there.get(name) is not None
    pack, start, size = there._find(packs._key(name)) or pytest.fail()
    with Path(pack.path).open("r+b") as file:
        file.seek(start + size // 2)
        file.write(b"\xff\xfe\xff\xfe")
    store = Store(tmp_path)
    told = heard(store)
    assert read(tmp_path, texts(), store) == expected and not parsed
    assert [line.partition("…")[2] for line in told] == [
        " in .coursebuild is damaged: it is made again"
    ]
    store = Store(tmp_path)
    told = heard(store)
    assert read(tmp_path, texts(), store) == expected and not told


def test_everything_is_made_again_where_that_is_wanted(tmp_path: Path, parsed: list[str]) -> None:
    expected = read(tmp_path, texts())
    parsed.clear()
    assert read(tmp_path, texts(), Store(tmp_path, fresh=True)) == expected
    assert len(parsed) == len(texts())


def test_what_may_not_be_kept_is_not(tmp_path: Path) -> None:
    """That a formula took too long may not happen again."""
    tasks = [Task.of(source, KINDS, True) for source in texts()]
    aside = Aside(tmp_path)
    kept_together = Together(Store(tmp_path), aside)
    kept = {task.key: aside.put(task.key.encode()) for task in tasks[1:]}
    kept_together.keep(tasks, kept)
    found = kept_together.get(tasks)
    assert {key: place() for key, place in found.items()} == {
        task.key: task.key.encode() for task in tasks[1:]
    }
    assert Together(Store(tmp_path, fresh=True), aside).get(tasks) == {}


def test_few_texts_are_looked_up_by_themselves(tmp_path: Path) -> None:
    sources = texts(module._MANY - 1)
    read(tmp_path, sources)
    tasks = [Task.of(source, KINDS, True) for source in sources]
    assert Together(Store(tmp_path), Aside(tmp_path)).get(tasks) == {}
