"""Which tool this is: a name for its code, its templates and what it bundles.

Entry points: `tool_digest()`; `typesetter_digest()`, of what typesets formulas; `code_digest`, of
some code, by its content; `step_key`, the keys of what the tool makes.

What is installed beside it belongs to it, by the versions: it may import any of that. The files'
sizes and times tell one tool from another, so that none of them need be read. A tool that was
installed anew makes everything once more, though it may be the same.
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
    """A hash over everything that the tool consists of, features of others and Python included."""
    return hashlib.sha256(f"{_tool()}\0{features_digest()}".encode()).hexdigest()


@functools.cache
def _tool() -> str:
    return _digest(os.path.dirname(_CORE), str(templates_dir()), str(assets_dir()))  # noqa: PTH120


@functools.cache
def typesetter_digest() -> str:
    """A hash over what makes MathML of TeX."""
    return _digest(str(assets_dir() / "temml"), os.path.join(_CORE, "run"))  # noqa: PTH118


@functools.cache
def _installed() -> str:
    """What is installed and its versions, by the folders that installing it leaves."""
    found: list[str] = []
    for folder in sys.path:
        with contextlib.suppress(OSError):
            names = os.listdir(folder or ".")  # noqa: PTH208
            found += sorted(name for name in names if name.endswith(".dist-info"))
    return "\0".join(found)


def _digest(*folders: str) -> str:
    digest = hashlib.sha256(f"{sys.version}\0{_installed()}\0".encode("utf-8", "surrogateescape"))
    for folder in folders:
        for line in _lines(folder, ""):
            digest.update(line.encode("utf-8", "surrogateescape"))
    return digest.hexdigest()


def _lines(folder: str, inner: str) -> Iterator[str]:
    """A line for each file, sorted, without the place of the folder."""
    with os.scandir(folder) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        name = f"{inner}/{entry.name}"
        if entry.is_dir():
            if entry.name != "__pycache__":
                yield from _lines(entry.path, name)
        elif not entry.name.endswith((".pyc", "~")):
            status = entry.stat()
            yield f"{name}\0{status.st_size}\0{status.st_mtime_ns}\0"


def step_key(name: str, *values: object) -> str:
    """The key of what a step of this name makes of these values.

    The tool is part of it: so there is no rule about what makes a thing stale.
    """
    return fingerprint((tool_digest(), name, values))


def code_digest(*parts: str, root: Path = Path(_CORE).parents[1]) -> str:
    """A hash over packages and modules, such as `mjcourse/spatial` or `coursebuild/numerics`.

    What takes minutes to measure is kept as long as this is the same, whenever it was installed.

    Raises:
        FileNotFoundError: the tool has no such part.
        EffectError: it cannot be read.
    """
    digest = hashlib.sha256()
    for part in parts:
        if not (root / part).exists():
            raise FileNotFoundError(part)
    try:
        for whole in (root / part for part in parts):
            for path in (whole,) if whole.is_file() else sorted(whole.rglob("*.py")):
                name = path.relative_to(root).as_posix()
                content = path.read_bytes()
                digest.update(f"{name}\0{len(content)}\0".encode())
                digest.update(content)
    except OSError as error:
        raise EffectError(f"the tool's own code cannot be read: {reason(error)}") from None
    return digest.hexdigest()
