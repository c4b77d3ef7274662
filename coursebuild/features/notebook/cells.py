"""A lesson as a Jupyter notebook that runs.

Entry point: `note_cells`, the cells that the lesson itself gives; `files` makes a notebook of them,
with what its scripts need around them.

1. Markdown cells are cut at headings and at scripts. Links are made whole with the course's
   address, or left as they are on the page where it has none.
2. Each script is a cell of its own. The magic `%%example`, which a cell at the start makes, writes
   the cell to its file and runs it in a process of its own, under the conditions of recorded
   outputs: so `__file__`, `sys.argv`, `sys.exit`, imports of other scripts and the hash seed are
   what they are when the course is checked, and one script sees nothing of another.
3. A recorded output is the output of its cell.
4. The id of a cell hangs on the heading above it, or on its script.
"""

from __future__ import annotations

import functools
import hashlib
import json
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias
from urllib.parse import urljoin, urlsplit

from coursebuild.core.model import (
    Block,
    Heading,
    Script,
    Table,
    child_blocks,
    walk_blocks,
)
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.marks import hang, link
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.features.markdown.copies import head
from coursebuild.features.markdown.writer import DocumentWriter

Cell: TypeAlias = dict[str, Any]
"""As nbformat has it."""
_MAGIC = "%%example"
_DEEPEST = 3
"""Headings down to this level begin a cell."""


def note_cells(inputs: PageInputs, page: PageContext | None, body: str) -> bytes:
    """The cells of a lesson as JSON; nothing for another page."""
    if page is None or inputs.head.kind != "lesson":
        return b""
    words, address = page.renderer.words, page.inputs.address
    locate = functools.partial(_whole, address)
    here = locate(page.place.href(inputs.head.path))
    writer = DocumentWriter(page, locate, here, notebook=True)
    parts = head(inputs, words, locate)
    if address:
        parts.append(link(writer.words("exports.on_site"), here))
    cells = [*_cells(writer, page.document.blocks), *_footnotes(writer)]
    counts: Counter[str] = Counter()
    for cell in cells:
        counts[cell["id"]] += 1
        cell["id"] += f"-{counts[cell['id']]}"
    return json.dumps([markdown_cell("head", "\n\n".join(parts)), *cells]).encode()


def markdown_cell(name: str, text: str) -> Cell:
    """A cell of Markdown; `name` is its id."""
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": _lines(text)}


def code_cell(name: str, text: str, output: str | None = None, *, hidden: bool = False) -> Cell:
    """A cell of Python with what it printed."""
    stream = {"output_type": "stream", "name": "stdout"}
    outputs = [] if output is None else [stream | {"text": _lines(output, "\n")}]
    return {
        "cell_type": "code",
        "id": name,
        "metadata": {"jupyter": {"source_hidden": True}} if hidden else {},
        "execution_count": None,
        "outputs": outputs,
        "source": _lines(text),
    }


def _lines(text: str, end: str = "") -> list[str]:
    lines = text.rstrip("\n").split("\n")
    return [*[f"{line}\n" for line in lines[:-1]], f"{lines[-1]}{end}"]


def _whole(address: str, href: str) -> str:
    """An address on the page at an address as it is anywhere."""
    return urljoin(address, href) if address and not urlsplit(href).scheme else href


def _cells(writer: DocumentWriter, blocks: Iterable[Block]) -> Iterator[Cell]:
    """The cells of blocks, whose ids are not numbered yet."""
    section = "start"
    waiting: list[Block] = []
    joined = writer.page.script_outputs
    done = {id(one) for some in joined.values() for one in some}

    def written() -> Iterator[Cell]:
        text = writer.blocks(waiting)
        if text:
            yield _text(section, text)
        waiting.clear()

    for block in blocks:
        if isinstance(block, Script):
            yield from written()
            yield from _script_cells(writer, section, block)
        elif id(block) in done:
            continue
        else:
            if isinstance(block, Heading) and block.level <= _DEEPEST:
                yield from written()
                section = block.anchor
            waiting.append(block)
            nested = list(_nested(writer, section, child_blocks(block)))
            if nested:
                yield from written()
                yield from nested
    yield from written()


def _nested(writer: DocumentWriter, section: str, blocks: tuple[Block, ...]) -> Iterator[Cell]:
    """The scripts inside a block, each in a cell after it."""
    for block in walk_blocks(blocks):
        if isinstance(block, Script):
            yield from _script_cells(writer, section, block)


def _footnotes(writer: DocumentWriter) -> Iterator[Cell]:
    footnotes = writer.page.document.footnotes
    if footnotes:
        notes = (hang(f"{n.number}. ", writer.blocks(n.blocks)) for n in footnotes)
        title = f"## {writer.words('markup.footnotes')}"
        yield _text("footnotes", "\n\n".join((title, *notes)))
    for note in footnotes:
        yield from _nested(writer, "footnotes", note.blocks)


def _script_cells(writer: DocumentWriter, section: str, block: Script) -> Iterator[Cell]:
    """A script, and what is to be said of its outputs."""
    recordings = writer.page.script_outputs.get(block.span.start, ())
    run = writer.page.inputs.runs.get(block.path)
    ran = run is not None and run.outcome is Outcome.OK
    output = None
    remarks: list[str] = []
    for recording in recordings:
        if ran and output is None and not isinstance(recording.body, Table):
            output = f"{recording.body.text.rstrip()}\n"
            remarks.append(f"{writer.inlines(recording.caption)} {writer.receipt(recording)}")
        else:
            remarks.append(writer.recording(recording))
    if block.norun:
        remarks.insert(0, writer.words("exports.norun"))
    yield code_cell(f"code-{_slug(block.path)}", _magic(block) + block.code.text, output)
    if remarks:
        yield _text(section, "\n\n".join(remarks))


def _magic(block: Script) -> str:
    options = [f"--requires={','.join(block.requires)}"] if block.requires else []
    options += ["--norun"] if block.norun else []
    return f"{shlex.join((_MAGIC, *options, block.path, *block.args))}\n"


def _text(section: str, text: str) -> Cell:
    return markdown_cell(f"text-{_slug(section)}", text)


_OTHERS = re.compile(r"[^a-zA-Z0-9]+")


def _slug(name: str) -> str:
    """A part of a cell's id, which may have few characters."""
    plain = _OTHERS.sub("-", name.removeprefix("examples/").removesuffix(".py"))
    if name.isascii() and 0 < len(plain) <= 40:
        return plain.strip("-") or "x"
    return hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:12]
