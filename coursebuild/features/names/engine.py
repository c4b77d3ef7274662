"""The names of the installed MuJoCo, of MJCF, and of the modules that scripts import.

Entry points: `EngineNames`; `engine_names`, the table, which one child process makes for each
version of MuJoCo and set of modules; `list_names` for another interpreter.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.child import JsonChild
from coursebuild.core.run.script_environment import Interpreter, engine_version, python_version
from coursebuild.core.text.source import key_of
from coursebuild.features.names import introspect

_KIND = "names"
_SECONDS = 30.0


class EngineName(Struct, frozen=True):
    """A function, a field or a method."""

    text: str = ""
    """Its signature or declaration."""
    doc: str = ""
    extent: tuple[str, ...] = ()
    """The shape of an array, in MuJoCo's sizes."""
    type: str = ""
    """The class of its value, where it is one of MuJoCo."""


class EngineNames(Struct, frozen=True, dict=True):
    """All names of a version of MuJoCo, and some of what lies beside it."""

    version: str
    functions: dict[str, EngineName]
    constants: dict[str, str]
    enums: dict[str, tuple[str, ...]]
    classes: dict[str, dict[str, EngineName]]
    elements: dict[str, dict[str, tuple[str, ...]]]
    """The elements of MJCF: by the elements that they stand in, their attributes there."""
    modules: dict[str, frozenset[str]]
    """`*` is among the names of a module that may have more."""

    @functools.cached_property
    def enum_of(self) -> dict[str, str]:
        """The enumeration of each of their members."""
        return {member: enum for enum, members in self.enums.items() for member in members}

    @functools.cached_property
    def classes_of(self) -> dict[str, tuple[str, ...]]:
        """The classes with a field or method of a name; also as C names it, as `efc_pos`."""
        classes: dict[str, tuple[str, ...]] = {}
        for name, members in self.classes.items():
            for member in members:
                classes[member] = (*classes.get(member, ()), name)
        return classes

    @functools.cached_property
    def attributes(self) -> frozenset[str]:
        """The attributes of all elements of MJCF."""
        places = (attributes for e in self.elements.values() for attributes in e.values())
        return frozenset(attribute for attributes in places for attribute in attributes)

    @functools.cached_property
    def words(self) -> frozenset[str]:
        """Every single name, and every parameter of a function."""
        signatures = (function.text for function in self.functions.values())
        parameters = {part for text in signatures for part in text.replace("(", " ").split()}
        return frozenset(
            (
                *self.functions,
                *self.constants,
                *self.enums,
                *self.enum_of,
                *self.classes,
                *self.classes_of,
                *self.elements,
                *self.attributes,
                *(part.strip(":,()") for part in parameters if part.isascii()),
            )
        )


class EngineTable(Struct, frozen=True, dict=True):
    """The names as they are kept: decoded when the first one is looked up."""

    data: bytes

    @functools.cached_property
    def names(self) -> EngineNames:
        """The names."""
        return _decode(self.data)


@functools.lru_cache(maxsize=4)
def _decode(data: bytes) -> EngineNames:
    return msgspec.json.decode(data, type=EngineNames)


def engine_names(
    store: Store, interpreter: Interpreter | None, modules: Iterable[str]
) -> EngineTable:
    """The names of the MuJoCo that the scripts use, and of modules that they import.

    Raises:
        EffectError: MuJoCo cannot be loaded.
    """
    python = sys.executable if interpreter is None else interpreter.python
    engine = engine_version() if interpreter is None else interpreter.engine
    version = python_version() if interpreter is None else interpreter.version
    folders = sys.path if interpreter is None else interpreter.packages
    packages = [Path(folder) for folder in folders if folder.endswith("-packages")]
    states = [str(folder.stat().st_mtime_ns) for folder in packages if folder.is_dir()]
    key = key_of(engine, version, python, *sorted(modules), "", *states, _code())
    return EngineTable(_recall(store, python, key, tuple(sorted(modules))))


@functools.cache
def _code() -> str:
    return Path(introspect.__file__).read_text("utf-8")


_in_memory: dict[str, bytes] = {}


def _recall(store: Store, python: str, key: str, modules: tuple[str, ...]) -> bytes:
    """The names from this process, the store or a child."""
    data = _in_memory.get(key) or store.get(_KIND, key, bytes)
    if data is None:
        data = msgspec.json.encode(list_names(python, modules))
        store.put(_KIND, key, data)
    _in_memory[key] = data
    return data


def list_names(python: str, modules: Iterable[str] = ()) -> EngineNames:
    """List the names of the MuJoCo of an interpreter, and of modules, in a child process.

    Raises:
        EffectError: MuJoCo cannot be loaded.
    """
    with JsonChild(introspect.__file__, _SECONDS, python) as child:
        answer = child.ask(sorted(modules))
        if answer is None:
            raise EffectError(f"listing the names of MuJoCo {child.death()}")
    return msgspec.convert(answer, EngineNames)
