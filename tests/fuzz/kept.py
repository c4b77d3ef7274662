"""What the tool has kept for itself: what varies is also what stands behind a true seal.

The first byte of an input says in which form it is put in the place of what was kept.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import msgspec
from msgspec import Struct

from coursebuild.core.engine.manifest import KIND, MARKER
from coursebuild.core.engine.publish import publish
from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.trust import FOLDER, seal, store_key
from coursebuild.core.files.write import journal_path, undo_changes
from coursebuild.core.model.results import CompileResult, OutputFile
from coursebuild.core.run.run_record import from_bytes
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from coursebuild.core.values import DAMAGE, decode, encode
from coursebuild.features.lab.export.script import LabExport
from coursebuild.features.search.index_files import IndexPlan, join_slices, sort_terms
from fuzz.texts import PATH, lessons
from support.random_lessons import KINDS
from support.search_shards import read_shard

WHOLE, SEALED, AS_JSON = b"\0", b"\1", b"\2"
"""The input is the file; or what was sealed in it; or that, written as JSON."""


# --- entries of the store


class _Kind(NamedTuple):
    read: Callable[[bytes], object]
    write: Callable[[Any], bytes]


_SOURCE = Source(PATH, "## One\n\nWords `1`{out}.\n")
_ENTRIES = (
    _Kind(lambda data: decode(_repacked(data), Parsed, _SOURCE), encode),
    _Kind(from_bytes, msgspec.json.encode),
    _Kind(lambda data: value_reader(CompileResult)(_repacked(data)), msgspec.msgpack.encode),
    _Kind(lambda data: value_reader(LabExport)(_repacked(data)), msgspec.msgpack.encode),
)


def _repacked(data: bytes) -> bytes:
    """JSON, whose bytes are easier to vary, as the MessagePack that is kept; all else unchanged."""
    try:
        return msgspec.msgpack.encode(json.loads(data))
    except (*DAMAGE, OverflowError):
        return data


def entry(data: bytes) -> None:
    """It is refused, or is whole: what is read can be written."""
    kind = _ENTRIES[data[0] % len(_ENTRIES)] if data else _ENTRIES[0]
    try:
        value = kind.read(data[1:])
    except DAMAGE:
        return
    if isinstance(value, Struct):
        kind.write(value)


def entries() -> Iterator[bytes]:
    for text in lessons():
        source = Source(PATH, text.decode()[:300])
        packed = encode(parse_document(source, KINDS, lesson=True))
        yield b"\0" + json.dumps(msgspec.msgpack.decode(packed)).encode()
    dependency = '{"kind":"file","name":"a","state":"b"}'
    inputs = '{"path":"a.py","facts":[["a","b"]]}'
    yield b'\1{"inputs":%s,"dependencies":[%s],"made":1,"forgotten":"","kept":{}}' % (
        inputs.encode(),
        dependency.encode(),
    )
    yield b'\2{"error":"a","line":1,"facts":null}'


# --- journals

_FILES = {
    "course/content/a.md": "new",
    "course/content/b.md": "edited since",
    "course/content/folder/c.md": "new",
    "course/.git/config": "new",
    "course/.venv/a.pth": "new",
    "course/.hidden": "new",
    "beside/file": "new",
}
_LINKS = {"course/out": "../beside", "course/content/link.md": "a.md"}


def journal(data: bytes) -> None:
    """Nothing outside of what a command may change is changed, and the journal is settled.

    Where a path of it may not be written, the command ends with a message.
    """
    form, payload = data[:1], data[1:]
    with TemporaryDirectory() as top:
        for path, text in _FILES.items():
            Path(top, path).parent.mkdir(parents=True, exist_ok=True)
            Path(top, path).write_text(text)
        for path, target in _LINKS.items():
            Path(top, path).symlink_to(target)
        root = Path(top, "course")
        file = journal_path(root)
        assert file is not None
        file.parent.mkdir(parents=True, exist_ok=True)
        key, before = store_key(str(root)), _contents(top)
        file.write_bytes(payload if form == WHOLE else seal("changes", _packed(form, payload), key))
        messages: list[str] = []
        try:
            undo_changes(root, messages.append)
            assert not file.exists()
        except EffectError as error:
            messages.append(error.message)
        after = _contents(top)
        damaged = file.with_suffix(".damaged")
        assert len(messages) == 1 or (before == after and not messages and not damaged.exists())
        for left in (file, damaged):
            left.unlink(missing_ok=True)
        for path in before.keys() | after.keys():
            if before.get(path) != after.get(path):
                folder, *parts = path.split("/")
                assert folder == "course" and not {".git", ".venv"}.intersection(parts), path
                assert path not in before or not any(part.startswith(".") for part in parts), path


def _packed(form: bytes, payload: bytes) -> bytes:
    if form != AS_JSON:
        return payload
    try:
        changes = msgspec.json.decode(payload, type=list[dict[str, str | None]])
    except DAMAGE:
        return payload
    values = (
        {
            key: value if key == "path" or value is None else value.encode()
            for key, value in change.items()
        }
        for change in changes
    )
    return msgspec.msgpack.encode(list(values))


def _contents(top: str) -> dict[str, bytes]:
    """All files below a folder but the tool's own, and where its links lead."""
    contents = {}
    for folder, folders, files in os.walk(top):
        folders[:] = {*folders} - {FOLDER}
        for name in (*files, *folders):
            path = Path(folder, name)
            if path.is_symlink():
                contents[path.relative_to(top).as_posix()] = os.fsencode(path.readlink())
            elif path.is_file():
                contents[path.relative_to(top).as_posix()] = path.read_bytes()
    return contents


def journals() -> Iterator[bytes]:
    changes = [
        [("content/a.md", "old", "new"), ("content/b.md", "old", "new")],
        [("content/a.md", None, "new"), ("content/new.md", "old", None)],
        [("content/folder/c.md", None, "new"), ("content/folder/d.md", "old", "new")],
        [(".git/config", "old", "new"), (".hidden", "old", "new"), (".new", "old", None)],
        [("../beside/file", "old", "new"), ("out/file", "old", "new"), ("/tmp/x", "old", None)],
        [("content/link.md", "old", "new"), ("content", "old", "new"), ("content/a.md/x", "o", "")],
        [(f"content/{'long' * 80}.md", "old", None), (".venv/a.pth", "old", "new")],
        [],
    ]
    for group in changes:
        values = [dict(zip(("path", "old", "new"), change, strict=True)) for change in group]
        yield AS_JSON + json.dumps(values).encode()
        packed = _packed(AS_JSON, json.dumps(values).encode())
        yield SEALED + packed
        yield WHOLE + packed


# --- manifests and markers of sites

_SITE_PATHS = ("index.html", "lessons/1.1/index.html")
_MARKER = b"\3"


def manifest(data: bytes) -> None:
    """A site is published whole, or the old one stays: whatever was kept of it, and is in it.

    `INODE`, `SIZE`, `TIME` and `DIGEST` stand for those of the first page that is there.
    """
    form, payload = data[:1], data[1:]
    with TemporaryDirectory() as top:
        root, out = Path(top, "course"), Path(top, "course/public")
        root.mkdir()
        Path(top, "beside").write_text("beside")
        publish(root, out, _site("one"))
        folder = Store(root).folder / KIND
        (file,) = folder.iterdir()
        ((_, entry_parts), *_) = msgspec.msgpack.decode(file.read_bytes()[32:]).items()
        words = zip((b"DIGEST", b"SIZE", b"TIME", b"INODE"), entry_parts[1:], strict=True)
        for word, value in words:
            payload = payload.replace(word, str(value).encode())
        payload = payload if form == _MARKER else _repacked(payload)
        if form == _MARKER:
            (out / MARKER).write_bytes(payload)
        elif form == WHOLE:
            file.write_bytes(payload)
        else:
            file.write_bytes(seal(f"{KIND}/{file.name}", payload, store_key(str(root))))
        try:
            publish(root, out, _site("two"))
            expected = "two"
        except EffectError:
            assert form == _MARKER
            expected = "one"
        pages = {path: (out / path).read_text() for path in _SITE_PATHS}
        assert pages == {file.path: file.data.decode() for file in _site(expected)}
        assert Path(top, "beside").read_text() == "beside"
        assert {path.name for path in Path(top).iterdir()} == {"beside", "course"}


def _site(text: str) -> list[OutputFile]:
    return [OutputFile(path, f"{text} {path}".encode()) for path in _SITE_PATHS]


def manifests() -> Iterator[bytes]:
    page = '["key","DIGEST",SIZE,TIME,INODE]'
    for text in (
        f'{{"index.html":{page}}}',
        f'{{"index.html":{page},"lessons/1.1/index.html":{page},"../../beside":{page}}}',
        f'{{"index.html/":{page},"a\\u0000b":{page},"/etc/passwd":{page},"":{page}}}',
        '{"index.html":["a","b",-1,1e400,null]}',
        "{}",
    ):
        yield SEALED + text.encode()
        yield WHOLE + text.encode()
    header = "site built by coursebuild; every file listed here may be replaced"
    yield _MARKER + f"{header}\nindex.html\nlessons/1.1/index.html\n".encode()
    yield _MARKER + f"{header}\n../../beside\n/etc\n".encode()
    yield _MARKER + b"other\n"


# --- slices of the search


def slices(data: bytes) -> None:
    """What is sorted has each term where it was.

    After the first byte: pages, between which is the byte 1, of terms with blanks.
    """
    plan = IndexPlan(4, 2)
    texts = data[1:].decode("utf-8", "replace").split("\1")
    pages = [{term: len(term) % 16 for term in text.replace("\0", " ").split()} for text in texts]
    weighed = ["\n".join(f"{weight:x}{term}" for term, weight in page.items()) for page in pages]
    batches = [
        sort_terms(plan, (text.encode() for text in weighed[start : start + 16]))
        for start in range(0, len(weighed), 16)
    ]
    actual: dict[str, list[tuple[int, int]]] = {}
    for parts in [*zip(*batches, strict=True)][: plan.terms]:
        actual |= read_shard(join_slices(parts))
    expected: dict[str, list[tuple[int, int]]] = {}
    for number, page in enumerate(pages):
        for term, weight in page.items():
            expected.setdefault(term, []).append((number, weight))
    assert actual == expected


def slice_groups() -> Iterator[bytes]:
    yield AS_JSON + "mass Energie \1 mass naïve 漢字\1\1x".encode()
    yield AS_JSON + b"\1".join(b"a b%d" % number for number in range(40))
