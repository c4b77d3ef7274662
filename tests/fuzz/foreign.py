"""What others send: figures, models, sources, courses of other tools, messages of an editor."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import json
import logging
import posixpath
import re
import sys
import traceback
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import UsageError
from coursebuild.core.registry import installed_features
from coursebuild.core.run.mjcf import read_tags
from coursebuild.core.scripts.figures import describe_difference, prepare_figure
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.importer.convert import convert
from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.features.references import csl
from coursebuild.features.references.bibtex import check_identifier, read_works
from coursebuild.features.references.csl import StyleFailure, format_works
from coursebuild.pipeline.options import Options
from coursebuild.preview.session import Session
from fuzz.texts import FIXTURES, MAP, PATH, ROOT, describe, seed_texts
from support.fixture_cases import read_cases
from support.random_lessons import KINDS

# --- figures

_PNG = b"\x89PNG\r\n\x1a\n"
_ACTIVE = re.compile(r"(?:\{.*\})?(?:script|foreignobject|iframe|object|embed|handler|listener)$")
_DRAWING = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 1L2 3"/></svg>\n'
_TABLE = b"x,y\n0,1\n0.5,2e3\n"


def figure(data: bytes) -> None:
    """It is refused, or recorded: in a form that stays the same, and has nothing that acts."""
    name, sample = "a.csv", _TABLE
    if data.startswith(_PNG[:2]):
        name, sample = "a.png", _png(2, 2)
    elif data.lstrip().startswith((b"<", b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")):
        name, sample = "a.svg", _DRAWING
    prepared = prepare_figure(name, data)
    describe_difference(name, data, sample)  # what is recorded may be a contributor's
    if isinstance(prepared, str):
        assert prepared
        return
    assert prepare_figure(name, prepared) == prepared
    describe_difference(name, sample, prepared)
    describe_difference(name, data, prepared)
    if name == "a.svg":
        for element in ET.fromstring(prepared).iter():
            assert not _ACTIVE.match(str(element.tag).lower()), element.tag
            for key, value in element.attrib.items():
                local = key.rpartition("}")[2]
                assert not local.startswith("on"), key
                if local == "href":
                    assert value.startswith(("#", "data:image/")), value


def _png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return len(data).to_bytes(4, "big") + kind + data + check.to_bytes(4, "big")

    header = width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x00\0\0\0"
    pixels = zlib.compress(bytes((width + 1) * min(height, 64)))
    return _PNG + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def figures() -> Iterator[bytes]:
    yield _DRAWING
    for path in sorted((ROOT / "content").rglob("*.svg")):
        yield path.read_bytes()[:3000]
    for case in read_cases(FIXTURES / "rules/figure-unreadable.md"):
        yield from (text.encode() for text in re.findall(r"<svg.*?</svg>", case.input, re.DOTALL))
    for part in (*seed_texts("figure"), b"<g>" * 60 + b"</g>" * 60):
        yield _DRAWING.replace(b"</svg>", part + b"</svg>")
    yield b"<?xml version='1.0' encoding='utf-16'?><!DOCTYPE svg [<!ENTITY a 'b'>]>" + _DRAWING
    yield _DRAWING.decode().encode("utf-16")
    yield _TABLE
    yield b'a,"b\r\nc",\r1e999,nan\n"'
    yield _png(3, 2)
    yield _png(1 << 15, 1 << 15)


# --- models


def model(text: str) -> None:
    """The places of attributes are those of their values."""
    for tag in read_tags(text):
        for _, value, place in tag.attributes:
            assert text[slice(*place)] == value


def models() -> Iterator[bytes]:
    yield b"<mujoco><!-- <a> --><worldbody><geom size='1'/>\n<![CDATA[ <b ]]></worldbody></mujoc>"
    yield from (b"<!--", b"<![CDATA[", b'<a b="', b"<a>", b"<a b='c' ")
    yield from (path.read_bytes() for path in sorted((ROOT / "models").glob("*.xml")))


# --- lists of sources

_STYLE = b"\n@@STYLE@@\n"
"""Comes before a style of citations."""


def sources(data: bytes) -> None:
    """What is wrong is reported, or what can be read is formatted."""
    text, _, style_text = data.decode("utf-8", "replace").partition(_STYLE.decode())
    installed_features()  # they have the rules
    source = Source("content/references.bib", text)
    works = read_works(source).value
    style = Source("content/references.csl", style_text) if style_text else None
    with contextlib.suppress(StyleFailure):
        formatted = format_works(source, style, "en", tuple(work.key for work in works))
        for work in works:
            check_identifier(work)
            assert "<script" not in formatted.entries[work.key]
            formatted.mark(work.key, "p. 12")


def source_lists() -> Iterator[bytes]:
    style = (Path(csl.__file__).parent / "style.csl").read_bytes()
    (works,) = seed_texts("sources")
    yield from (works, *works.split(b"\n\n"), works + _STYLE + style)


# --- courses of other tools

_FILE = re.compile(rb"^-- (?P<path>\S[^\n]*?)(?: -> (?P<link>\S[^\n]*?))? --\n", re.MULTILINE)
"""The line before the text of a file; or a link, and where it leads."""
_SECRET = "a secret of this machine"
_NEW_FOLDERS = ("content", "models", "src", ".gitignore", "IMPORT.md")


def folder(data: bytes) -> None:
    """A folder of files; it is refused in words, or becomes a course whose map can be read."""
    with TemporaryDirectory() as top:
        Path(top, "secret.md").write_text(_SECRET)
        course = Path(top, "course")
        course.mkdir()
        marks = list(_FILE.finditer(data))
        for mark, end in zip(marks, [*(m.start() for m in marks[1:]), len(data)], strict=False):
            path = course / posixpath.normpath(mark["path"].decode("utf-8", "surrogateescape"))
            try:
                if path.resolve().is_relative_to(course.resolve()):
                    path.parent.mkdir(parents=True, exist_ok=True)
                    if mark["link"]:
                        path.symlink_to(mark["link"].decode("utf-8", "surrogateescape"))
                    elif not path.is_symlink():
                        path.write_bytes(data[mark.end() : end])
            except (OSError, RuntimeError, ValueError):
                continue  # no file has such a name, or links go round
        _import(course)


def dialect(text: str) -> None:
    """One text, in Markdown of any tool."""
    with TemporaryDirectory() as top:
        Path(top, "1-one.md").write_text(text, "utf-8", "surrogateescape", newline="")
        _import(Path(top))


def _import(course: Path) -> None:
    try:
        converted = convert(SourceFiles(course))
    except UsageError as error:
        assert str(error)
        return
    for path, data in converted.files.items():
        assert path == posixpath.normpath(path) and path.split("/")[0] in _NEW_FOLDERS, path
        assert _SECRET.encode() not in data, path
        if path.startswith(("content/lessons/", "content/pages/")):
            parse_document(Source(path, data.decode()), KINDS, lesson="/lessons/" in path)
    map_result = parse_course_map(
        Source("content/course.toml", converted.files["content/course.toml"].decode())
    )
    describe(*map_result.diagnostics)
    assert map_result.value is not None, [d.message for d in map_result.diagnostics]


def folders() -> Iterator[bytes]:
    tops = sorted((ROOT / "tests/features/importer").glob("*/source"))
    for top in tops:
        files = [path for path in sorted(top.rglob("*")) if path.is_file()]
        for group in (files, *([file] for file in files)):
            yield b"".join(
                f"-- {path.relative_to(top)} --\n".encode() + path.read_bytes() for path in group
            )
    text = b"-- a/1.md --\n# One\n\nText, [a link](../b.md).\n-- b.md --\nB\n"
    for settings in seed_texts("folder"):
        yield settings + text


def dialects() -> Iterator[bytes]:
    for path in sorted((ROOT / "tests/features/importer").glob("*/source/**/*.*md")):
        yield path.read_bytes()
    yield from seed_texts("dialect")


# --- messages of an editor

_URI = b"file:///COURSE/"
"""Stands in inputs for the folder of the course."""
_LESSON = next(seed_texts("messages")).decode()


class _Client:
    """A client of one server, whose course lies in a folder of its own."""

    def __init__(self) -> None:
        from coursebuild.features.language_server.commands.server import Server

        self._top = TemporaryDirectory()
        root = Path(self._top.name).resolve()
        for path, text in (("content/course.toml", MAP), (PATH, _LESSON)):
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        self.root = root
        self.session = Session(Options(root, 1, Store(root)), site=False)
        self.session.read()
        self.server = Server(self.session)
        self.protocol = self.server.client.protocol
        self.protocol.set_writer(io.BytesIO())
        self.server.client.report_server_error = self._take_error  # type: ignore[method-assign]
        self.errors: list[str] = []
        """The tracebacks of answers that failed."""
        logging.getLogger("pygls").setLevel(logging.CRITICAL + 1)

    def _take_error(self, error: Exception, source: object) -> None:
        """Take what the library reports, unless it is a refusal, or a message that is none."""
        failure = sys.exception() or error
        frames = traceback.extract_tb(failure.__traceback__)
        is_ours = any(
            "/language_server/" in f.filename for f in frames if "/pygls/" not in f.filename
        )
        is_refusal = type(failure).__name__ == "JsonRpcInvalidParams"
        if is_ours and not is_refusal:
            self.errors.append("".join(traceback.format_exception(failure)))

    async def send(self, data: bytes) -> None:
        """Send messages, a line each, and read what they edited as the server does."""
        from coursebuild.features.language_server.commands.diagnosis import (
            current_diagnostics,
            to_lsp,
        )

        self.protocol.set_writer(io.BytesIO())
        start = b'{"jsonrpc":"2.0","id":0,"method":"initialize","params":{"capabilities":{}}}'
        lines = (start, *data.replace(_URI, self.root.as_uri().encode() + b"/").split(b"\n"))
        for line in lines:
            open_texts = self.session.open_texts
            try:
                message = json.loads(line, object_hook=self.protocol.structure_message)
                if getattr(message, "method", "") not in ("shutdown", "exit"):
                    self.protocol.handle_message(message)
            except Exception:  # the library's own loop notes it and goes on
                continue
            if self.session.open_texts is not open_texts:
                self._read()
                for diagnostic in current_diagnostics(self.session):
                    to_lsp(diagnostic, self.server.places)
        if self.session.open_texts:
            self.session.open_texts = {}
            self._read()

    def _read(self) -> None:
        if self.session.edit([*self.session.open_texts, PATH], is_saved=False) is None:
            self.session.read(is_saved=False)


@functools.cache
def _client() -> _Client:
    return _Client()


def messages(data: bytes) -> None:
    """Messages in JSON, a line each: none makes an answer fail."""
    client = _client()
    client.errors.clear()
    with ThreadPoolExecutor(1) as pool:  # a browser of other tests may have a loop in this thread
        pool.submit(asyncio.run, client.send(data)).result()
    assert not client.errors, client.errors[0]
    assert client.session.course is not None


def conversations() -> Iterator[bytes]:
    """Messages about files of several kinds: `FILE` is the file, `"TEXT"` what is in it."""
    _, *seeds = seed_texts("messages")
    for path in (PATH, "content/course.toml", "content/none.md", "../x", "models/a.xml"):
        text = json.dumps(_LESSON if path == PATH else MAP).encode()
        for seed in seeds:
            yield seed.replace(b"FILE", _URI + path.encode()).replace(b'"TEXT"', text)
