"""Digests of the tool: of its code, its templates and what it bundles.

A digest covers all packages that are installed beside the tool, by name and version: any of them
may be imported. Of files it covers sizes and times, so that none has to be read; a tool that was
installed again therefore makes everything again, even if it is the same.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.resources import assets_dir, templates_dir
from coursebuild.core.registry import features_digest
from coursebuild.core.values import fingerprint

_CORE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # noqa: PTH100, PTH120


def tool_digest() -> str:
    """A hash over everything that the tool consists of, including Python and others' features."""
    return hashlib.sha256(f"{_tool()} {features_digest()}".encode()).hexdigest()


@functools.cache
def _tool() -> str:
    return _digest(os.path.dirname(_CORE), str(templates_dir()), str(assets_dir()))  # noqa: PTH120


@functools.cache
def typesetter_digest() -> str:
    """A hash over the code that turns TeX into MathML."""
    return _digest(str(assets_dir() / "temml"), os.path.join(_CORE, "run"))  # noqa: PTH118


@functools.cache
def _packages() -> tuple[str, ...]:
    """The installed packages by name and version, as their `.dist-info` is called."""
    names: list[str] = []
    for folder in sys.path:
        with contextlib.suppress(OSError):
            entries = sorted(os.listdir(folder or "."))  # noqa: PTH208
            names += (name for name in entries if name.endswith(".dist-info"))
    return tuple(names)


def _digest(*folders: str) -> str:
    lines = (line for folder in folders for line in _lines(folder, ""))
    text = "\0".join((sys.version, *_packages(), *lines))
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def _lines(folder: str, inner: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        ordered = sorted(entries, key=lambda entry: entry.name)
    for entry in ordered:
        name = f"{inner}/{entry.name}"
        if entry.is_dir():
            if entry.name != "__pycache__":
                yield from _lines(entry.path, name)
        elif not entry.name.endswith((".pyc", "~")):
            status = entry.stat()
            yield f"{name}\0{status.st_size}\0{status.st_mtime_ns}"


def step_key(name: str, *values: object) -> str:
    """The key of what a step makes from these values; with a new tool, another one."""
    return fingerprint((tool_digest(), name, values))


def code_digest(*parts: str, root: Path = Path(_CORE).parents[1]) -> str:
    """A hash over packages and modules, such as `mjcourse/spatial`.

    Measurements that take minutes are kept as long as this stays the same, even when the tool is
    installed again.

    Raises:
        FileNotFoundError: the tool has no such part.
        EffectError: it cannot be read.
    """
    digest = hashlib.sha256()
    for part in parts:
        if not (root / part).exists():
            raise FileNotFoundError(part)
    try:
        for place in (root / part for part in parts):
            for path in (place,) if place.is_file() else sorted(place.rglob("*.py")):
                name, content = path.relative_to(root).as_posix(), path.read_bytes()
                digest.update(f"{name}\0{len(content)}\0".encode() + content)
    except OSError as error:
        raise EffectError(f"the tool's own code cannot be read: {reason(error)}") from None
    return digest.hexdigest()
