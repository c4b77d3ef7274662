"""Digests of the tool: of its code, its templates and what it bundles.

A digest covers the packages that the tool and its features may import, by name and version. Of
files it covers sizes and times, so that none has to be read; a tool that was installed again
therefore makes everything again, even if it is the same.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.resources import assets_dir, templates_dir
from coursebuild.core.registry import feature_packages, features_digest
from coursebuild.core.values import fingerprint

_CORE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # noqa: PTH100, PTH120


def tool_digest() -> str:
    """A hash over everything that the tool consists of, including Python and others' features."""
    parts = _tool(), features_digest(), *package_versions(*feature_packages(), tuple(sys.path))
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogateescape")).hexdigest()


@functools.cache
def _tool() -> str:
    return _digest(os.path.dirname(_CORE), str(templates_dir()), str(assets_dir()))  # noqa: PTH120


@functools.cache
def typesetter_digest() -> str:
    """A hash over the code that turns TeX into MathML."""
    return _digest(str(assets_dir() / "temml"), os.path.join(_CORE, "run"))  # noqa: PTH118


@functools.lru_cache(maxsize=8)
def package_versions(
    names: frozenset[str], modules: frozenset[str], path: tuple[str, ...]
) -> tuple[str, ...]:
    """The names and versions of packages and of all that they need, from their `.dist-info`.

    Given are the names of some, and modules that others hold. Without a package of a name, as where
    the tool was never installed, all installed ones count.
    """
    folders: dict[str, str] = {}  # by name of the package
    for folder in path:
        with contextlib.suppress(OSError):
            for entry in sorted(os.listdir(folder or ".")):  # noqa: PTH208
                if entry.endswith(".dist-info"):
                    name = _normalize(entry.partition("-")[0])
                    folders.setdefault(name, os.path.join(folder, entry))  # noqa: PTH118
    pending = [(_normalize(name), frozenset[str]()) for name in names]
    if not all(name in folders for name, _ in pending):
        return tuple(sorted(os.path.basename(folder) for folder in folders.values()))  # noqa: PTH119
    foreign_modules = modules - sys.stdlib_module_names
    for name, folder in folders.items() if foreign_modules else ():
        record = "\n" + "".join(_lines_of(f"{folder}/RECORD"))
        if any(f"\n{module}{end}" in record for module in foreign_modules for end in "/."):
            pending.append((name, frozenset()))
    extras_by_name: dict[str, frozenset[str]] = {}
    while pending:
        name, extras = pending.pop()
        if name in extras_by_name and extras <= extras_by_name[name]:
            continue
        extras = extras_by_name[name] = extras | extras_by_name.get(name, frozenset())
        # Markers of systems do not matter: what they exclude is not installed.
        for line in _lines_of(f"{folders[name]}/METADATA") if name in folders else ():
            if line == "\n":  # a description follows
                break
            if (match := _REQUIREMENT.match(line)) is not None:
                for_extras = {_normalize(extra) for extra in _EXTRA.findall(match[3])}
                if not for_extras or for_extras & extras:
                    asked_extras = map(_normalize, re.findall(r"[\w.-]+", match[2] or ""))
                    pending.append((_normalize(match[1]), frozenset(asked_extras)))
    # One that is missing may be installed next.
    places = (folders.get(name, name) for name in sorted(extras_by_name))
    return tuple(map(os.path.basename, places))


def _normalize(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


_REQUIREMENT = re.compile(r"Requires-Dist: *([\w.-]+) *(?:\[([^\]]*)\])?(.*)")
_EXTRA = re.compile(r"""\bextra *== *["']([\w.-]+)["']""")


def _lines_of(path: str) -> Iterator[str]:
    with (
        contextlib.suppress(OSError),
        open(path, encoding="utf-8", errors="surrogateescape") as file,  # noqa: PTH123
    ):
        yield from file


def _digest(*folders: str) -> str:
    own_packages = package_versions(frozenset({"coursebuild"}), frozenset(), tuple(sys.path))
    versions = (sys.version, *own_packages, "")
    lines = (line for folder in folders for line in _lines(folder, ""))
    text = "\0".join(versions) + "".join(lines)
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
            yield f"{name}\0{status.st_size}\0{status.st_mtime_ns}\0"


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
