"""What is installed, for the archives in which scripts are downloaded.

Entry points: `distributions(modules)`, `library_files()`.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Iterable
from pathlib import Path

from coursebuild.results import OutputFile


def distributions(modules: Iterable[str]) -> tuple[tuple[str, str, str], ...]:
    """(module, distribution, version) of each top-level module that an installed package provides.

    Sorted by module. The standard library, `mjcourse` and what is not installed are left out.
    """
    provided = importlib.metadata.packages_distributions()
    found = []
    for module in sorted(set(modules) - {"mjcourse", "coursebuild"}):
        names = sorted(set(provided.get(module, ())))
        if names:
            found.append((module, names[0], importlib.metadata.version(names[0])))
    return tuple(found)


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
