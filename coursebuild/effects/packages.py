"""What is installed, for the archives in which scripts are downloaded.

Entry points: `distributions(modules)`, `kept_distributions`, `library_files()`.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import sys
import time
from collections.abc import Iterable
from pathlib import Path

from coursebuild.effects.store import Store
from coursebuild.results import OutputFile

_FOLDERS = ("site-packages", "dist-packages")
_TICK = 2_000_000_000
"""The coarsest clock of a file system, ns."""


def distributions(modules: Iterable[str]) -> tuple[tuple[str, str, str], ...]:
    """(module, distribution, version) of each top-level module that an installed package provides.

    Sorted by module. The standard library, `mjcourse` and what is not installed are left out.
    """
    import importlib.metadata

    provided = importlib.metadata.packages_distributions()
    found = []
    for module in sorted(set(modules) - {"mjcourse", "coursebuild"}):
        names = sorted(set(provided.get(module, ())))
        if names:
            found.append((module, names[0], importlib.metadata.version(names[0])))
    return tuple(found)


def kept_distributions(store: Store, modules: Iterable[str]) -> tuple[tuple[str, str, str], ...]:
    """The same from the store, as long as no folder with packages changes."""
    wanted = sorted(set(modules))
    signature = _signature()
    if not wanted:
        return ()
    if signature is None:
        return distributions(wanted)
    key = hashlib.sha256("\0".join((signature, *wanted)).encode("utf-8", "surrogateescape"))

    def make() -> bytes:
        return json.dumps(distributions(wanted)).encode()

    data = store.kept("packages", key.hexdigest(), make)
    return tuple((module, name, version) for module, name, version in json.loads(data))


def _signature() -> str | None:
    """The folders with packages, as they are now; none while they change."""
    parts = [sys.version]
    for folder in sys.path:
        if not folder.endswith(_FOLDERS):  # other places change often, and no package is put there
            continue
        try:
            status = Path(folder).stat()
        except OSError:
            continue
        if time.time_ns() - status.st_mtime_ns < _TICK:
            return None
        parts.append(f"{folder}\0{status.st_mtime_ns}\0{status.st_ino}")
    return "\0".join(parts)


def library_files() -> tuple[OutputFile, ...]:
    """The source files of `mjcourse`, by path relative to the folder that holds the package."""
    spec = importlib.util.find_spec("mjcourse")
    if spec is None or spec.origin is None:
        return ()
    folder = Path(spec.origin).parent
    files = (p for p in folder.rglob("*") if p.suffix == ".py" or p.name == "py.typed")
    return tuple(
        OutputFile(path.relative_to(folder.parent).as_posix(), path.read_bytes())
        for path in sorted(files)
        if "__pycache__" not in path.parts
    )
