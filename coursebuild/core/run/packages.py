"""The packages that scripts import.

Nothing is imported. Reading what each distribution provides takes a quarter of a second, so the
whole map is stored under the names in the folders with installed packages, which say their
versions. A module that no distribution names, and one of this tool's own, is identified by the
content of its files.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.model.results import OutputFile
from coursebuild.core.run.script_environment import installed_distributions

ABSENT = ""
_TOOL_PACKAGE = "coursebuild"
_LIBRARY = Path(__file__).resolve().parents[3]
_FOLDERS = ("site-packages", "dist-packages")


def site_folders() -> tuple[str, ...]:
    """The folders with installed packages, which scripts see as well."""
    return tuple(path for path in sys.path if Path(path).name in _FOLDERS)


class InstalledPackages:
    """The packages that are installed for the interpreter that runs the scripts."""

    def __init__(self, store: Store, folders: Sequence[str] | None = None) -> None:
        self._folders = site_folders() if folders is None else tuple(folders)
        self._distributions = functools.cache(lambda: _map_distributions(store, self._folders))
        self.version = functools.cache(self._version)
        """The version of a module, such as `numpy 2.4.6`; empty where there is no such module."""

    def _version(self, module: str) -> str:
        distribution = self._distributions().get(module)
        if distribution is not None:
            return distribution
        spec = _spec(module, self._folders) or _spec(module, [str(_LIBRARY)])
        if spec is None or not spec.submodule_search_locations:
            return ABSENT if spec is None else f"files {file_state(spec.origin or '')[:16]}"
        digest = hashlib.sha256()
        for top in sorted(spec.submodule_search_locations):
            for file in sorted(Path(top).rglob("*")):
                if "__pycache__" not in file.parts and file.is_file():
                    state = file_state(str(file))
                    digest.update(f"{file.relative_to(top).as_posix()}\0{state}\0".encode())
        return f"files {digest.hexdigest()[:16]}"


def distributions(
    store: Store, modules: Iterable[str], folders: Sequence[str] | None = None
) -> tuple[tuple[str, str, str], ...]:
    """(module, distribution, version) of each top-level module that an installed package provides.

    Sorted by module. The standard library, `mjcourse` and what is not installed are left out.
    `folders` are those of another interpreter's packages.
    """
    names = sorted(set(modules))
    by_module = _map_distributions(store, folders or site_folders()) if names else {}
    rows = []
    for module in names:
        name, _, version = by_module.get(module, "").split(", ")[0].rpartition(" ")
        if name:
            rows.append((module, name, version))
    return tuple(rows)


def module_files(name: str, folders: Iterable[Path]) -> tuple[OutputFile, ...]:
    """The files of a module from the first of these folders that has it; their paths are relative.

    `mjcourse`, where none has it, is the one that came with this tool.
    """
    spec = importlib.util.find_spec(name) if name == "mjcourse" else None
    ours = [] if spec is None or spec.origin is None else [Path(spec.origin).parents[1]]
    for folder in (*folders, *ours):
        paths = sorted([folder / f"{name}.py", *(folder / name).rglob("*")])
        files = tuple(
            OutputFile(path.relative_to(folder).as_posix(), path.read_bytes())
            for path in paths
            if path.is_file() and "__pycache__" not in path.parts
        )
        if files:
            return files
    return ()


def _spec(module: str, folders: Sequence[str]) -> ModuleSpec | None:
    with contextlib.suppress(ImportError, ValueError):
        return PathFinder.find_spec(module, list(folders))
    return None


def _map_distributions(store: Store, folders: Sequence[str]) -> Mapping[str, str]:
    contents: list[list[str]] = []
    for folder in folders:
        contents.append([])
        with contextlib.suppress(OSError):
            contents[-1] = sorted(os.listdir(folder))  # noqa: PTH208
    key = hashlib.sha256(repr((sys.version, *contents)).encode()).hexdigest()
    # It is no result of the course, so that `--no-cache` does not make it again.
    names = store.peek("installed", key, value_reader(dict[str, str]))
    if names is None:
        names_by_module: dict[str, set[str]] = {}
        seen_names: set[str] = set()
        for distribution in installed_distributions(folders):
            name = distribution.metadata["Name"] or ""
            if name in seen_names or name == _TOOL_PACKAGE:  # the first on the path counts
                continue
            seen_names.add(name)
            top_level = distribution.read_text("top_level.txt") or ""
            modules = {module.rpartition("/")[2] for module in top_level.split()}
            for file in () if top_level else distribution.files or ():
                first = file.parts[0] if file.parts else ""
                if len(file.parts) > 1 and first.isidentifier():
                    modules.add(first)
                elif len(file.parts) == 1 and file.suffix in (".py", ".so", ".pyd"):
                    modules.add(first.split(".")[0])
            for module in modules:
                names_by_module.setdefault(module, set()).add(f"{name} {distribution.version}")
        names = {module: ", ".join(sorted(names)) for module, names in names_by_module.items()}
        store.put_value("installed", key, names)
    return names
