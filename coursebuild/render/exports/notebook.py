"""A lesson as a Jupyter notebook that runs.

Entry points: `notebook(sheet, document, tools, base_url)`, all that the lesson itself gives, and
`finished(notebook, …)`, the file, with what its scripts need around them.

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

import base64
import functools
import hashlib
import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeAlias
from urllib.parse import urljoin, urlsplit

from coursebuild.model import (
    Block,
    Document,
    Heading,
    Script,
    Table,
    child_blocks,
    walk_blocks,
)
from coursebuild.render import urls, zips
from coursebuild.render.context import PageContext
from coursebuild.render.exports.markdown import code_span, escaped, hang, link, write_blocks
from coursebuild.render.exports.plain import Plain
from coursebuild.render.exports.twin import head
from coursebuild.render.sheet import Sheet
from coursebuild.render.tools import Tools
from coursebuild.results import Outcome
from coursebuild.values import dataclass

Json: TypeAlias = "dict[str, Json] | list[Json] | str | int | bool | None"

MAGIC = "%%example"
MOST = 4 << 20
"""Bytes of one file that a notebook carries at most, and of all of them."""
_SLOT = "\ue000"
"""Stands for a name in the texts of a notebook."""
_DEEPEST = 3
"""Headings down to this level begin a cell."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell: Markdown, or a script with what it printed."""

    section: str
    """The anchor of the heading above it."""
    text: str
    script: str = ""
    """The path of the script that a code cell holds."""
    output: str | None = None


@dataclass(frozen=True, slots=True)
class Notebook:
    """What a lesson gives to its notebook."""

    head: str
    """Markdown of the first cell."""
    cells: tuple[Cell, ...]
    python: str
    """Version of the interpreter that ran the scripts."""
    words: tuple[tuple[str, str], ...]
    """Texts of the first cells, by key, as Markdown."""


def notebook(sheet: Sheet, document: Document, tools: Tools, base_url: str) -> Notebook:
    """The cells of a lesson."""
    assert sheet.shown is not None, "the page of a document shows it"
    page = PageContext.made(tools, sheet.shown, urls.Place(sheet.path), document)
    here = _whole(base_url, sheet.path, page.place.href(sheet.path))
    locate = functools.partial(_whole, base_url, sheet.path)
    context = Plain(page, locate, here, notebook=True)
    parts = head(sheet, tools.words, locate)
    if base_url:
        parts.append(link(context.words("exports.on_site"), here))
    cells = list(_cells(context, document.blocks))
    if document.footnotes:
        notes = (hang(f"{n.number}. ", context.blocks(n.blocks)) for n in document.footnotes)
        title = f"## {context.words('markup.footnotes')}"
        cells.append(Cell("footnotes", "\n\n".join((title, *notes))))
        for note in document.footnotes:
            cells += _nested(context, "footnotes", note.blocks)
    keys = ("before", "install", "setup", "setup_none", "left_out")
    texts = tuple((key, escaped(tools.words(f"exports.{key}", zip=_SLOT))) for key in keys)
    return Notebook("\n\n".join(parts), tuple(cells), sheet.shown.python, texts)


def _whole(base_url: str, path: str, href: str) -> str:
    """An address on a page as it is anywhere."""
    if not base_url or urlsplit(href).scheme:
        return href
    return urljoin(f"{base_url.rstrip('/')}/{urls.encode(path)}", href)


def _cells(context: Plain, blocks: Iterable[Block]) -> Iterator[Cell]:
    section = "start"
    waiting: list[Block] = []
    joined = context.page.joined
    done = {id(one) for some in joined.values() for one in some}

    def told() -> Iterator[Cell]:
        text = write_blocks(waiting, context)
        if text:
            yield Cell(section, text)
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


def _nested(context: Plain, section: str, blocks: tuple[Block, ...]) -> Iterator[Cell]:
    """The scripts inside a block, each in a cell after it."""
    for block in walk_blocks(blocks):
        if isinstance(block, Script):
            yield from _script_cells(context, section, block)


def _script_cells(context: Plain, section: str, block: Script) -> Iterator[Cell]:
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
    yield Cell(section, _magic(block) + block.code.text, block.path, output)
    if told:
        yield Cell(section, "\n\n".join(told))


def _magic(block: Script) -> str:
    options = [f"--requires={','.join(block.requires)}"] if block.requires else []
    options += ["--norun"] if block.norun else []
    return f"{shlex.join((MAGIC, *options, block.path, *block.args))}\n"


# ------------------------------------------------------------------------------------ the file


def finished(
    made: Notebook, archive: zips.Archive | None, imports: Callable[[str], frozenset[str]]
) -> bytes:
    """The notebook as a file; `archive` is that of the lesson's scripts."""
    words = dict(made.words)
    cells = [_markdown("head", made.head)]
    if archive is not None:
        cells += _setup(made, archive, imports, words)
    ids: dict[str, int] = {}
    for cell in made.cells:
        kind = "code" if cell.script else "text"
        base = f"{kind}-{_slug(cell.script or cell.section)}"
        ids[base] = number = ids.get(base, 0) + 1
        name = f"{base}-{number}"
        if cell.script:
            cells.append(_code(name, cell.text, cell.output))
        else:
            cells.append(_markdown(name, cell.text))
    kernel: Json = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
    language: Json = {"name": "python", "file_extension": ".py", "mimetype": "text/x-python"}
    document: Json = {
        "cells": list(cells),
        "metadata": {"kernelspec": kernel, "language_info": language},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    text = json.dumps(document, ensure_ascii=False, indent=1, sort_keys=True)
    return f"{text}\n".encode("utf-8", "replace")


def _slug(name: str) -> str:
    """A part of a cell's id, which may have few characters."""
    plain = re.sub(r"[^a-zA-Z0-9]+", "-", name.removeprefix("examples/").removesuffix(".py"))
    if name.isascii() and 0 < len(plain) <= 40:
        return plain.strip("-") or "x"
    return hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:12]


def _markdown(name: str, text: str) -> Json:
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": _lines(text)}


def _code(name: str, text: str, output: str | None = None, *, hidden: bool = False) -> Json:
    outputs: list[Json] = []
    if output is not None:
        outputs.append({"output_type": "stream", "name": "stdout", "text": _lines(output, "\n")})
    return {
        "cell_type": "code",
        "id": name,
        "metadata": {"jupyter": {"source_hidden": True}} if hidden else {},
        "execution_count": None,
        "outputs": outputs,
        "source": _lines(text),
    }


def _lines(text: str, end: str = "") -> list[Json]:
    lines = text.rstrip("\n").split("\n")
    return [*(f"{line}\n" for line in lines[:-1]), f"{lines[-1]}{end}"]


def _setup(
    made: Notebook,
    archive: zips.Archive,
    imports: Callable[[str], frozenset[str]],
    words: Mapping[str, str],
) -> Iterator[Json]:
    files = {path.partition("/")[2]: data for path, data in archive.files.items()}
    needed = sorted(files.pop("requirements.txt", b"").decode().split())
    files.pop("README.md", None)
    own = [cell.script for cell in made.cells if cell.script]
    early = _needed_early(own, files, imports)
    files = {path: data for path, data in files.items() if path not in own or path in early}
    small = _small(files)
    title, text = f"## {words['before']}", words["setup" if files else "setup_none"]
    if small.keys() != files.keys():
        name = code_span(archive.path.rpartition("/")[2])
        text += " " + words["left_out"].replace(_SLOT, name)
    if needed:
        yield _markdown("before", f"{title}\n\n{words['install']}")
        yield _code("install", f"# %pip install {' '.join(needed)}")
        title = ""
    yield _markdown("before-setup", f"{title}\n\n{text}".strip())
    yield _code("setup", setup_code(small, sorted(files.keys() - small.keys())), hidden=True)


def _small(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files that a notebook can carry, the smallest first."""
    room, found = MOST, {}
    for path, data in sorted(files.items(), key=lambda item: (len(item[1]), item[0])):
        room -= len(data)
        if room >= 0:
            found[path] = data
    return found


def _needed_early(
    own: list[str], files: Mapping[str, bytes], imports: Callable[[str], frozenset[str]]
) -> set[str]:
    """The scripts of the lesson that one above them imports, maybe through others."""
    modules = {
        path.removeprefix("examples/").removesuffix(".py"): path
        for path in files
        if re.fullmatch(r"examples/[^/]+\.py", path)
    }
    early: set[str] = set()
    for at, path in enumerate(own):
        seen, waiting = set[str](), [path]
        while waiting:
            one = waiting.pop()
            if one in files and one not in seen:
                seen.add(one)
                named = imports(files[one].decode("utf-8", "replace"))
                waiting += [modules[name] for name in named if name in modules]
        early |= seen.intersection(own[at + 1 :])
    return early


def setup_code(files: Mapping[str, bytes], missing: list[str]) -> str:
    """The cell that writes the files and makes the magic."""
    packed = base64.b64encode(zips.pack(files)).decode() if files else ""
    lines = "\n".join(packed[at : at + 100] for at in range(0, len(packed), 100))
    code = _SETUP.replace("ELSEWHERE = ()", f"ELSEWHERE = {tuple(missing)!r}")
    return code.replace('FILES = ""', f'FILES = """\n{lines}\n"""' if packed else 'FILES = ""')


_SETUP = '''\
"""Write what the scripts need beside this notebook, and make the magic %%example."""

import base64
import importlib.util
import io
import os
import pathlib
import shlex
import subprocess
import sys
import threading
import zipfile

from IPython.core.magic import no_var_expand, register_cell_magic

FILES = ""
ELSEWHERE = ()
CONDITIONS = {
    "PYTHONHASHSEED": "0", "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1", "TZ": "UTC",
    "PYTHONDONTWRITEBYTECODE": "1", "NO_COLOR": "1", "TERM": "dumb", "MPLBACKEND": "Agg",
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
}  # under which outputs were recorded


def unpack():
    """Write the files that are not there."""
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(FILES))) as archive:
        for name in archive.namelist():
            path, data = pathlib.Path(name), archive.read(name)
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            elif path.read_bytes() != data:
                print(f"{name} is there and is another than this lesson's: it is left as it is")


def copy(source, target):
    for line in source:
        target.write(line)


def run(name, arguments):
    """Run a script, its output shown as it comes."""
    command = [sys.executable, name, *arguments]
    environment = {**os.environ, **CONDITIONS}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe,
        encoding="utf-8", errors="replace",
    ) as process:
        errors = threading.Thread(target=copy, args=(process.stderr, sys.stderr))
        errors.start()
        try:
            copy(process.stdout, sys.stdout)
            process.wait()
        except BaseException:
            process.kill()
            raise
        finally:
            errors.join()
    if process.returncode:
        raise RuntimeError(f"{name} ended with status {process.returncode}")


@register_cell_magic
@no_var_expand
def example(line, cell):
    """Write the cell to the file that the line names, and run it with the words after the name."""
    words = shlex.split(line)
    options = {}
    while words and words[0].startswith("--"):
        option, _, value = words.pop(0).partition("=")
        options[option] = value
    name, *arguments = words
    path = pathlib.Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((cell.rstrip("\\n") + "\\n").encode())
    needed = filter(None, options.get("--requires", "").split(","))
    missing = [one for one in needed if importlib.util.find_spec(one.partition(".")[0]) is None]
    if missing:
        print(f"{name} is not run: it needs {', '.join(missing)}")
    elif "--norun" not in options:
        run(name, arguments)


if FILES:
    unpack()
for name in ELSEWHERE:
    if not pathlib.Path(name).exists():
        raise FileNotFoundError(f"{name} is not there: unpack the lesson's archive here")
sys.path.insert(0, os.path.abspath("examples"))
'''
