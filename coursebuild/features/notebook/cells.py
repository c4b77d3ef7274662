"""A lesson as a Jupyter notebook that runs.

Entry point: `note_cells`, the cells of the lesson itself; `files` makes a notebook of them, with
what its scripts need.

1. A new Markdown cell begins at each heading and after each script. Links get the course's address;
   if it has none, they stay as they are on the page.
2. Each script is a cell of its own. The magic `%%example`, defined by a cell at the start, writes
   the cell to its file and runs it in a process of its own, under the conditions of recorded
   outputs: `__file__`, `sys.argv`, `sys.exit`, imports of other scripts and the hash seed are as
   they are when the course is checked, and scripts do not share state.
3. A recorded output is the output of its cell.
4. The id of a cell depends on the heading above it, or on its script.
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
    walk_blocks,
)
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.marks import hang, link
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.features.markdown.copies import head
from coursebuild.features.markdown.writer import DocumentWriter

Cell: TypeAlias = dict[str, Any]
"""A cell in the format of nbformat."""
_MAGIC = "%%example"
_MAX_LEVEL = 3
"""Headings up to this level begin a cell."""


def note_cells(inputs: PageInputs, page: PageContext | None, body: str) -> bytes:
    """Return the cells of a lesson as JSON; nothing for other pages."""
    if page is None or inputs.head.kind != "lesson":
        return b""
    words, address = page.renderer.words, page.inputs.address
    locate = functools.partial(_make_absolute, address)
    page_address = locate(page.place.href(inputs.head.path))
    writer = DocumentWriter(page, locate, page_address, notebook=True)
    parts = head(inputs, words, locate)
    if address:
        parts.append(link(writer.words("exports.on_site"), page_address))
    cells = [*_block_cells(writer, page.document.blocks), *_footnote_cells(writer)]
    counts: Counter[str] = Counter()
    for cell in cells:
        counts[cell["id"]] += 1
        cell["id"] += f"-{counts[cell['id']]}"
    return json.dumps([markdown_cell("head", "\n\n".join(parts)), *cells]).encode()


def markdown_cell(name: str, text: str) -> Cell:
    """Return a cell of Markdown; `name` is its id."""
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": _lines(text)}


def code_cell(name: str, text: str, output: str | None = None, *, hidden: bool = False) -> Cell:
    """Return a cell of Python with its output."""
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


def _make_absolute(address: str, href: str) -> str:
    """Make a link of the page at an address absolute."""
    return urljoin(address, href) if address and not urlsplit(href).scheme else href


def _block_cells(writer: DocumentWriter, blocks: Iterable[Block]) -> Iterator[Cell]:
    """Yield the cells of blocks, with ids that are not numbered yet."""
    section = "start"
    pending: list[Block] = []
    script_outputs = writer.page.script_outputs.values()
    output_ids = {id(output) for outputs in script_outputs for output in outputs}

    def flush() -> Iterator[Cell]:
        text = writer.blocks(pending)
        if text:
            yield _text_cell(section, text)
        pending.clear()

    for block in blocks:
        if id(block) in output_ids:
            continue
        if isinstance(block, Heading) and block.level <= _MAX_LEVEL:
            yield from flush()
            section = block.anchor
        if not isinstance(block, Script):
            pending.append(block)
        if scripts := _find_scripts((block,)):
            yield from flush()
            for script in scripts:
                yield from _script_cells(writer, section, script)
    yield from flush()


def _find_scripts(blocks: tuple[Block, ...]) -> list[Script]:
    """Return the scripts among some blocks and inside them."""
    return [block for block in walk_blocks(blocks) if isinstance(block, Script)]


def _footnote_cells(writer: DocumentWriter) -> Iterator[Cell]:
    footnotes = writer.page.document.footnotes
    if footnotes:
        notes = (hang(f"{n.number}. ", writer.blocks(n.blocks)) for n in footnotes)
        title = f"## {writer.words('markup.footnotes')}"
        yield _text_cell("footnotes", "\n\n".join((title, *notes)))
    for note in footnotes:
        for script in _find_scripts(note.blocks):
            yield from _script_cells(writer, "footnotes", script)


def _script_cells(writer: DocumentWriter, section: str, block: Script) -> Iterator[Cell]:
    """Yield the cell of a script, and a cell of remarks about its outputs."""
    recordings = writer.page.script_outputs.get(block.span.start, ())
    run = writer.page.inputs.runs.get(block.path)
    is_run = run is not None and run.outcome is Outcome.OK
    output = None
    remarks: list[str] = []
    for recording in recordings:
        if is_run and output is None and not isinstance(recording.body, Table):
            output = f"{recording.body.text.rstrip()}\n"
            remarks.append(f"{writer.caption(recording)} {writer.receipt(recording)}")
        else:
            remarks.append(writer.recording(recording))
    if block.norun:
        remarks.insert(0, writer.words("exports.norun"))
    yield code_cell(f"code-{_slug(block.path)}", _magic(block) + block.code.text, output)
    if remarks:
        yield _text_cell(section, "\n\n".join(remarks))


def _magic(block: Script) -> str:
    options = [f"--requires={','.join(block.requires)}"] if block.requires else []
    options += ["--norun"] if block.norun else []
    return f"{shlex.join((_MAGIC, *options, block.path, *block.args))}\n"


def _text_cell(section: str, text: str) -> Cell:
    return markdown_cell(f"text-{_slug(section)}", text)


_NOT_IN_IDS = re.compile(r"[^a-zA-Z0-9]+")


def _slug(name: str) -> str:
    """Return a part of a cell's id, which is limited in length and characters."""
    plain = _NOT_IN_IDS.sub("-", name.removeprefix("examples/").removesuffix(".py"))
    if name.isascii() and 0 < len(plain) <= 40:
        return plain.strip("-") or "x"
    return hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:12]
