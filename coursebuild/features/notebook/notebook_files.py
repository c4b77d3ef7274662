"""Lessons as Jupyter notebooks that run.

1. A new Markdown cell begins at each heading and after each script. The id of a cell depends on the
   heading above it, or on its script.
2. Each script is a cell of its own, at the place of its last part. The magic `%%example`, defined
   by a cell at the start, writes the cell to its file and runs it in a process of its own, under
   the conditions of recorded outputs: `__file__`, `sys.argv`, `sys.exit`, imports of other scripts
   and the hash seed are as they are when the course is checked, and scripts do not share state.
3. Where the course map says in `[launch]` where notebooks can be run, the first cell with code
   installs the packages, in the versions of the runs that were verified.
4. A cell at the start contains the files that scripts need (models, `mjcourse`, other scripts),
   packed, and writes those that are missing.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import json
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias
from urllib.parse import quote, urljoin, urlsplit

import msgspec

from coursebuild.api import (
    CachedFile,
    Outcome,
    PageContext,
    PageInputs,
    SiteContext,
    model,
    regex,
    step_key,
    urls,
)
from coursebuild.core.pages import zips
from coursebuild.core.pages.marks import code_span, escape_marks, hang, link
from coursebuild.features.markdown.page_copies import head
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

    def locate(href: str) -> str:
        return urljoin(address, href) if address and not urlsplit(href).scheme else href

    page_address = locate(page.place.href(inputs.head.path))
    writer = DocumentWriter(page, locate, page_address, notebook=True)
    parts = head(inputs, words, locate)
    if address:
        parts.append(link(writer.words("exports.on_site"), page_address))
    cells = list(_block_cells(writer, page.document.blocks))
    footnotes = page.document.footnotes
    if footnotes:
        notes = (hang(f"{n.number}. ", writer.blocks(n.blocks)) for n in footnotes)
        title = f"## {writer.words('markup.footnotes')}"
        cells.append(_text_cell("footnotes", "\n\n".join((title, *notes))))
    if references := writer.references():
        cells.append(_text_cell("references", references))
    for note in footnotes:
        for script in _find_scripts(writer, note.blocks):
            cells += _script_cells(writer, "footnotes", script)
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


def _block_cells(writer: DocumentWriter, blocks: Iterable[model.Block]) -> Iterator[Cell]:
    """Yield the cells of blocks, with ids that are not numbered yet."""
    section = "start"
    pending: list[model.Block] = []
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
        if isinstance(block, model.Heading) and block.level <= _MAX_LEVEL:
            yield from flush()
            section = block.anchor
        scripts = _find_scripts(writer, (block,))
        if block not in scripts:
            pending.append(block)
        if scripts:
            yield from flush()
            for script in scripts:
                yield from _script_cells(writer, section, script)
    yield from flush()


_ScriptBlock: TypeAlias = "model.Script | model.ScriptPart"


def _find_scripts(writer: DocumentWriter, blocks: tuple[model.Block, ...]) -> list[_ScriptBlock]:
    """The blocks at whose places a cell has a script: of one with parts, the last part."""
    return [
        block
        for block in model.walk_blocks(blocks)
        if isinstance(block, model.Script | model.ScriptPart) and writer.is_cell(block)
    ]


def _script_cells(writer: DocumentWriter, section: str, block: _ScriptBlock) -> Iterator[Cell]:
    script = writer.page.script_places[block.span.start][0]
    recordings = writer.page.script_outputs.get(block.span.start, ())
    run = writer.page.inputs.runs.get(block.path)
    is_run = run is not None and run.outcome is Outcome.OK
    output = None
    remarks: list[str] = []
    for recording in recordings:
        body = recording.body
        if is_run and output is None and not (script.parts or isinstance(body, model.Table)):
            output = f"{body.text.rstrip()}\n"
            remarks.append(f"{writer.caption(recording)} {writer.receipt(recording)}")
        else:
            remarks.append(writer.recording(recording))
    if script.norun:
        remarks.insert(0, writer.words("exports.norun"))
    options = [f"--requires={','.join(script.requires)}"] if script.requires else []
    options += ["--norun"] if script.norun else []
    magic = shlex.join((_MAGIC, *options, script.path, *script.args))
    yield code_cell(f"code-{_slug(script.path)}", f"{magic}\n{script.code.text}", output)
    if remarks:
        yield _text_cell(section, "\n\n".join(remarks))


def _text_cell(section: str, text: str) -> Cell:
    return markdown_cell(f"text-{_slug(section)}", text)


_NOT_IN_IDS = regex(r"[^a-zA-Z0-9]+")


def _slug(name: str) -> str:
    """Return a part of a cell's id, which is limited in length and characters."""
    plain = _NOT_IN_IDS.sub("-", name.removeprefix("examples/").removesuffix(".py"))
    if name.isascii() and 0 < len(plain) <= 40:
        return plain.strip("-") or "x"
    return hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:12]


_MAX_SIZE = 4 << 20
"""The limit for the files in a notebook, in bytes."""
_PLACEHOLDER = "\ue000"


def notebook_files(site: SiteContext) -> Iterator[CachedFile]:
    """Yield the notebooks of all written lessons."""
    for page in site.pages:
        lesson = site.library.lessons[page.id]
        archive = site.archives.get(urls.lesson_zip_path(lesson))
        language = site.library.words.language
        installs = site.library.course.launch is not None
        key = step_key("notebook", language, installs, page.digest, archive.key if archive else "")
        path = urls.copy_path(page.path, ".ipynb")
        yield CachedFile(
            path, key, functools.partial(_write_notebook, site, lesson, page.path, archive)
        )


def _write_notebook(
    site: SiteContext, lesson: model.Lesson, page: str, archive: zips.Archive | None
) -> bytes:
    head, *cells = json.loads(site.note(page))
    setup = () if archive is None else _setup_cells(site, lesson, archive)
    authors = [{"name": author.name} for author in site.library.course.authors]
    document = {
        "cells": [head, *setup, *cells],
        "metadata": {
            **({"authors": authors} if authors else {}),
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


def _setup_cells(site: SiteContext, lesson: model.Lesson, archive: zips.Archive) -> Iterator[Cell]:
    assert lesson.document is not None, "a notebook is of a written lesson"
    files = {path.partition("/")[2]: data for path, data in archive.files.items()}
    requirements = files.pop("requirements.txt", b"").decode().splitlines()
    packages = [line for line in requirements if not line.startswith("#")]
    files.pop("README.md", None)
    scripts = [s.path for s in model.document_scripts(lesson.document) if s.is_python]
    early = _imported_early(site, scripts, files)
    files = {path: data for path, data in files.items() if path not in scripts or path in early}
    room, included = _MAX_SIZE, {}
    for path, data in sorted(files.items(), key=lambda item: (len(item[1]), item[0])):
        room -= len(data)
        if room >= 0:
            included[path] = data
    words = site.library.words
    title = f"## {escape_marks(words('exports.before'))}"
    text = escape_marks(words("exports.setup" if files else "exports.setup_none"))
    if included.keys() != files.keys():
        name = code_span(archive.path.rpartition("/")[2])
        text += f" {escape_marks(words('exports.left_out', zip=_PLACEHOLDER))}".replace(
            _PLACEHOLDER, name
        )
    if packages:
        is_elsewhere = site.library.course.launch is not None
        install_text = words("exports.install_here" if is_elsewhere else "exports.install")
        command = "%pip install -q" if is_elsewhere else "# %pip install"
        yield markdown_cell("before", f"{title}\n\n{escape_marks(install_text)}")
        yield code_cell("install", f"{command} {' '.join(packages)}")
        title = ""
    yield markdown_cell("before-setup", f"{title}\n\n{text}".strip())
    template = site.assets.template("notebook/setup.py")
    packed = base64.b64encode(zips.pack_files(included)).decode() if included else ""
    lines = "\n".join(packed[start : start + 100] for start in range(0, len(packed), 100))
    missing = tuple(sorted(files.keys() - included.keys()))
    code = template.replace("ELSEWHERE = ()", f"ELSEWHERE = {missing!r}")
    code = code.replace('FILES = ""', f'FILES = """\n{lines}\n"""' if packed else 'FILES = ""')
    yield code_cell("setup", code, hidden=True)


def _imported_early(site: SiteContext, scripts: list[str], files: Mapping[str, bytes]) -> set[str]:
    """Return the scripts of the lesson that one above them imports, directly or indirectly."""
    modules = {
        path.removeprefix("examples/").removesuffix(".py"): path
        for path in files
        if re.fullmatch(r"examples/[^/]+\.py", path)
    }
    early: set[str] = set()
    for number, script in enumerate(scripts[:-1], 1):
        visited, pending = set[str](), [script]
        while pending:
            path = pending.pop()
            if path in files and path not in visited:
                visited.add(path)
                names = site.imports(files[path].decode("utf-8", "replace"))
                pending += [modules[name] for name in names if name in modules]
        early |= visited.intersection(scripts[number:])
    return early


def launch_services(course: model.Course, path: str) -> tuple[tuple[str, str], ...]:
    """The services that can run the notebook at a site path, each with the address for it.

    A name of a branch or folder may hold anything that Git and file systems allow.
    """
    launch = course.launch
    if launch is None or launch.repository is None:
        return ()
    repository = launch.repository.rstrip("/").removesuffix(".git")
    host, _, project = repository.partition("://")[2].partition("/")
    file = f"{launch.folder}/{path}" if launch.folder else path
    branch, url = quote(launch.branch), quote(repository, safe="")
    services: list[tuple[str, str]] = []
    if launch.colab:  # what follows the branch is the file, so the branch may have no `/`
        ref = quote(launch.branch, safe="")
        address = f"https://colab.research.google.com/github/{project}/blob/{ref}/{quote(file)}"
        services.append(("Colab", address))
    if launch.binder:
        provider = f"git/{url}"
        if host.lower() == "github.com":
            provider = f"gh/{project}"
        elif host.lower() == "gitlab.com":
            provider = f"gl/{quote(project, safe='')}"
        place = f"{launch.binder.rstrip('/')}/v2/{provider}/{branch}"
        services.append(("Binder", f"{place}?labpath={quote(file, safe='')}"))
    if launch.jupyterhub:
        folder = project.rpartition("/")[2]
        inner = quote(f"lab/tree/{folder}/{quote(file)}", safe="")
        place = f"{launch.jupyterhub.rstrip('/')}/hub/user-redirect/git-pull"
        ref = quote(launch.branch, safe="")
        services.append(("JupyterHub", f"{place}?repo={url}&branch={ref}&urlpath={inner}"))
    if launch.codespaces:
        services.append(("Codespaces", f"https://codespaces.new/{project}/tree/{branch}"))
    return tuple(services)
