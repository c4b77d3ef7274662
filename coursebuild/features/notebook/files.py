"""The notebooks of a site: the cells of each lesson, and what its scripts need.

Entry point: `notebook_files`. A cell at the start contains the files that scripts need (models,
`mjcourse`, other scripts), packed, and writes those that are missing.
"""

from __future__ import annotations

import base64
import functools
import json
import re
from collections.abc import Iterator, Mapping

import msgspec

from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Lesson, document_scripts
from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages import urls, zips
from coursebuild.core.pages.added_files import SiteContext
from coursebuild.core.pages.marks import code_span, escape_marks
from coursebuild.features.notebook.cells import Cell, code_cell, markdown_cell

_MAX_SIZE = 4 << 20
"""The limit for the files in a notebook, in bytes."""
_PLACEHOLDER = "\ue000"
"""Stands for a name in a text."""


def notebook_files(site: SiteContext) -> Iterator[CachedFile]:
    """Yield the notebooks of all written lessons."""
    for page in site.pages:
        lesson = site.library.lessons[page.id]
        archive = site.archives.get(urls.lesson_zip_path(lesson))
        language = site.library.words.language
        key = step_key("notebook", language, page.digest, archive.key if archive else "")
        path = urls.copy_path(page.path, ".ipynb")
        yield CachedFile(
            path, key, functools.partial(_write_notebook, site, lesson, page.path, archive)
        )


def _write_notebook(
    site: SiteContext, lesson: Lesson, page: str, archive: zips.Archive | None
) -> bytes:
    head, *cells = json.loads(site.note(page))
    setup = () if archive is None else _setup_cells(site, lesson, archive)
    document = {
        "cells": [head, *setup, *cells],
        "metadata": {
            "kernelspec": {
                "display_name": "Python 3 (ipykernel)",
                "language": "python",
                "name": "python3",
            },
            "language_info": {
                "name": "python",
                "file_extension": ".py",
                "mimetype": "text/x-python",
            },
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    text = json.dumps(document, ensure_ascii=False, sort_keys=True)
    # As Jupyter writes it; `json` takes five times as long to indent.
    return msgspec.json.format(text.encode("utf-8", "replace"), indent=1) + b"\n"


def _setup_cells(site: SiteContext, lesson: Lesson, archive: zips.Archive) -> Iterator[Cell]:
    assert lesson.document is not None, "a notebook is of a written lesson"
    files = {path.partition("/")[2]: data for path, data in archive.files.items()}
    packages = sorted(files.pop("requirements.txt", b"").decode().split())
    files.pop("README.md", None)
    scripts = [script.path for script in document_scripts(lesson.document)]
    early = _imported_early(site, scripts, files)
    files = {path: data for path, data in files.items() if path not in scripts or path in early}
    included = _select_smallest(files)
    words = site.library.words
    title = f"## {escape_marks(words('exports.before'))}"
    text = escape_marks(words("exports.setup" if files else "exports.setup_none"))
    if included.keys() != files.keys():
        name = code_span(archive.path.rpartition("/")[2])
        text += f" {escape_marks(words('exports.left_out', zip=_PLACEHOLDER))}".replace(
            _PLACEHOLDER, name
        )
    if packages:
        yield markdown_cell("before", f"{title}\n\n{escape_marks(words('exports.install'))}")
        yield code_cell("install", f"# %pip install {' '.join(packages)}")
        title = ""
    yield markdown_cell("before-setup", f"{title}\n\n{text}".strip())
    template = site.assets.template("notebook/setup.py")
    code = _setup_code(template, included, sorted(files.keys() - included.keys()))
    yield code_cell("setup", code, hidden=True)


def _select_smallest(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files that a notebook can contain, the smallest first."""
    room, selection = _MAX_SIZE, {}
    for path, data in sorted(files.items(), key=lambda item: (len(item[1]), item[0])):
        room -= len(data)
        if room >= 0:
            selection[path] = data
    return selection


def _imported_early(site: SiteContext, scripts: list[str], files: Mapping[str, bytes]) -> set[str]:
    """Return the scripts of the lesson that one above them imports, directly or indirectly."""
    modules = {
        path.removeprefix("examples/").removesuffix(".py"): path
        for path in files
        if re.fullmatch(r"examples/[^/]+\.py", path)
    }
    early: set[str] = set()
    for number, script in enumerate(scripts, 1):
        visited, pending = set[str](), [script]
        while pending:
            path = pending.pop()
            if path in files and path not in visited:
                visited.add(path)
                names = site.imports(files[path].decode("utf-8", "replace"))
                pending += [modules[name] for name in names if name in modules]
        early |= visited.intersection(scripts[number:])
    return early


def _setup_code(template: str, files: Mapping[str, bytes], missing: list[str]) -> str:
    """Return the cell that writes the files and defines the magic."""
    packed = base64.b64encode(zips.pack_files(files)).decode() if files else ""
    lines = "\n".join(packed[start : start + 100] for start in range(0, len(packed), 100))
    code = template.replace("ELSEWHERE = ()", f"ELSEWHERE = {tuple(missing)!r}")
    return code.replace('FILES = ""', f'FILES = """\n{lines}\n"""' if packed else 'FILES = ""')
