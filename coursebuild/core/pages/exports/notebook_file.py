"""A notebook as a file: its cells with their ids, and what the scripts need around them.

Entry point: `notebook_file(notebook, archive, imports)`. The id of a cell hangs on the heading
above it or on its script.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

from coursebuild.core.pages import zips
from coursebuild.core.pages.exports.marks import code_span
from coursebuild.core.pages.exports.notebook import SLOT, Notebook

Json: TypeAlias = dict[str, Any]
Imports: TypeAlias = Callable[[str], frozenset[str]]
"""Says what a Python text imports."""
_MOST = 4 << 20
"""Bytes of files that a notebook carries at most."""


def notebook_file(made: Notebook, archive: zips.Archive | None, imports: Imports) -> bytes:
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
    kernel = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
    language = {"name": "python", "file_extension": ".py", "mimetype": "text/x-python"}
    document = {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": language},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    text = json.dumps(
        document, ensure_ascii=False, indent=1, sort_keys=True
    )  # as Jupyter writes it
    return f"{text}\n".encode("utf-8", "replace")


_OTHERS = re.compile(r"[^a-zA-Z0-9]+")


def _slug(name: str) -> str:
    """A part of a cell's id, which may have few characters."""
    plain = _OTHERS.sub("-", name.removeprefix("examples/").removesuffix(".py"))
    if name.isascii() and 0 < len(plain) <= 40:
        return plain.strip("-") or "x"
    return hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:12]


def _markdown(name: str, text: str) -> Json:
    return {"cell_type": "markdown", "id": name, "metadata": {}, "source": _lines(text)}


def _code(name: str, text: str, output: str | None = None, *, hidden: bool = False) -> Json:
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


def _setup(
    made: Notebook, archive: zips.Archive, imports: Imports, words: Mapping[str, str]
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
        text += " " + words["left_out"].replace(SLOT, name)
    if needed:
        yield _markdown("before", f"{title}\n\n{words['install']}")
        yield _code("install", f"# %pip install {' '.join(needed)}")
        title = ""
    yield _markdown("before-setup", f"{title}\n\n{text}".strip())
    yield _code("setup", setup_code(small, sorted(files.keys() - small.keys())), hidden=True)


def _small(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files that a notebook can carry, the smallest first."""
    room, found = _MOST, {}
    for path, data in sorted(files.items(), key=lambda item: (len(item[1]), item[0])):
        room -= len(data)
        if room >= 0:
            found[path] = data
    return found


def _needed_early(own: list[str], files: Mapping[str, bytes], imports: Imports) -> set[str]:
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
