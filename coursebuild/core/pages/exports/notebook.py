"""A lesson as a Jupyter notebook that runs.

Entry point: `notebook(inputs, page, base_url)`, all that the lesson itself gives; `notebook_file`
makes a file of it, with what its scripts need around them.

1. Markdown cells are cut at headings and at scripts. Links are made whole with the course's
   address, or left as they are on the page where it has none.
2. Each script is a cell of its own. The magic `%%example`, which a cell at the start makes, writes
   the cell to its file and runs it in a process of its own, under the conditions of recorded
   outputs: so `__file__`, `sys.argv`, `sys.exit`, imports of other scripts and the hash seed are
   what they are when the course is checked, and one script sees nothing of another.
3. A recorded output is the output of its cell.
4. The cell at the start carries the files that scripts need (models, `mjcourse`, other scripts),
   packed, and writes those that are not there. The id of a cell hangs on the heading above it.
"""

from __future__ import annotations

import functools
import shlex
from collections.abc import Iterable, Iterator
from urllib.parse import urljoin, urlsplit

from msgspec import Struct

from coursebuild.core.model import (
    Block,
    Heading,
    Script,
    Table,
    child_blocks,
    walk_blocks,
)
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.exports.markdown import write_blocks
from coursebuild.core.pages.exports.markdown_copy import head
from coursebuild.core.pages.exports.marks import escaped, hang, link
from coursebuild.core.pages.exports.plain import Plain
from coursebuild.core.pages.page_inputs import PageInputs

MAGIC = "%%example"
SLOT = "\ue000"
"""Stands for a name in the texts of a notebook."""
_DEEPEST = 3
"""Headings down to this level begin a cell."""


class NotebookCell(Struct, frozen=True):
    """A cell: Markdown, or a script with what it printed."""

    section: str
    """The anchor of the heading above it."""
    text: str
    script: str = ""
    """The path of the script that a code cell holds."""
    output: str | None = None


class Notebook(Struct, frozen=True):
    """What a lesson gives to its notebook."""

    head: str
    """Markdown of the first cell."""
    cells: tuple[NotebookCell, ...]
    words: tuple[tuple[str, str], ...]
    """Texts of the first cells, by key, as Markdown."""


def notebook(inputs: PageInputs, page: PageContext, base_url: str) -> Notebook:
    """The cells of a lesson."""
    document, words = page.document, page.tools.words
    here = _whole(base_url, inputs.path, page.place.href(inputs.path))
    locate = functools.partial(_whole, base_url, inputs.path)
    context = Plain(page, locate, here, notebook=True)
    parts = head(inputs, words, locate)
    if base_url:
        parts.append(link(context.words("exports.on_site"), here))
    cells = list(_cells(context, document.blocks))
    if document.footnotes:
        notes = (hang(f"{n.number}. ", context.blocks(n.blocks)) for n in document.footnotes)
        title = f"## {context.words('markup.footnotes')}"
        cells.append(NotebookCell("footnotes", "\n\n".join((title, *notes))))
        for note in document.footnotes:
            cells += _nested(context, "footnotes", note.blocks)
    keys = ("before", "install", "setup", "setup_none", "left_out")
    texts = tuple((key, escaped(words(f"exports.{key}", zip=SLOT))) for key in keys)
    return Notebook("\n\n".join(parts), tuple(cells), texts)


def _whole(base_url: str, path: str, href: str) -> str:
    """An address on a page as it is anywhere."""
    if not base_url or urlsplit(href).scheme:
        return href
    return urljoin(f"{base_url.rstrip('/')}/{urls.encode(path)}", href)


def _cells(context: Plain, blocks: Iterable[Block]) -> Iterator[NotebookCell]:
    section = "start"
    waiting: list[Block] = []
    joined = context.page.joined
    done = {id(one) for some in joined.values() for one in some}

    def told() -> Iterator[NotebookCell]:
        text = write_blocks(waiting, context)
        if text:
            yield NotebookCell(section, text)
        waiting.clear()

    for block in blocks:
        if isinstance(block, Script):
            yield from told()
            yield from _script_cells(context, section, block)
        elif id(block) in done:
            continue
        else:
            if isinstance(block, Heading) and block.level <= _DEEPEST:
                yield from told()
                section = block.anchor
            waiting.append(block)
            nested = list(_nested(context, section, child_blocks(block)))
            if nested:
                yield from told()
                yield from nested
    yield from told()


def _nested(context: Plain, section: str, blocks: tuple[Block, ...]) -> Iterator[NotebookCell]:
    """The scripts inside a block, each in a cell after it."""
    for block in walk_blocks(blocks):
        if isinstance(block, Script):
            yield from _script_cells(context, section, block)


def _script_cells(context: Plain, section: str, block: Script) -> Iterator[NotebookCell]:
    """A script, and what is to be said of its outputs."""
    recordings = context.page.joined.get(block.span.start, ())
    run = context.page.shown.runs.get(block.path)
    ran = run is not None and run.outcome is Outcome.OK
    output = None
    told: list[str] = []
    for recording in recordings:
        if ran and output is None and not isinstance(recording.body, Table):
            output = f"{recording.body.text.rstrip()}\n"
            told.append(f"{context.inlines(recording.caption)} {context.receipt(recording)}")
        else:
            told.append(context.recording(recording))
    if block.norun:
        told.insert(0, context.words("exports.norun"))
    yield NotebookCell(section, _magic(block) + block.code.text, block.path, output)
    if told:
        yield NotebookCell(section, "\n\n".join(told))


def _magic(block: Script) -> str:
    options = [f"--requires={','.join(block.requires)}"] if block.requires else []
    options += ["--norun"] if block.norun else []
    return f"{shlex.join((MAGIC, *options, block.path, *block.args))}\n"
