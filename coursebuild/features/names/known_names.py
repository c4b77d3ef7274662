"""The names that can be known: of MuJoCo, of MJCF, and of coursebuild itself.

Entry points: `EngineNames`; `engine_names`, the table, which one child process makes for each
version of MuJoCo; `list_names` for another interpreter; `find_engine_name`,
`element_href`, what a name means and where MuJoCo's manual has it.

Of coursebuild, `options_by_command`; `tables_of` a kind of file, as the course map; and what a name
of each sort means: `resolve_command`, `resolve_option`, `resolve_table`.
"""

from __future__ import annotations

import functools
import importlib.util
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

import msgspec
import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.api import EffectError, Interpreter, Store, did_you_mean
from coursebuild.core.registry import CORE_COMMANDS, features
from coursebuild.core.run import mjcf
from coursebuild.core.run.child import JsonChild
from coursebuild.core.run.script_environment import engine_version, python_version
from coursebuild.core.syntax.course_schema import CourseFile
from coursebuild.core.text.source import key_of

_MANUAL = "https://mujoco.readthedocs.io/en/{}/{}"
_KIND = "names"
_SECONDS = 30.0
_PROGRAM = str(Path(__file__).with_name("introspect.py"))
ITEM_CLASSES = {
    "MjContactList": "MjContact",
    "MjSolverStatList": "MjSolverStat",
    "MjTimerStatList": "MjTimerStat",
    "MjWarningStatList": "MjWarningStat",
}
"""The classes of the items of lists."""


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
    declared: frozenset[str]
    """The words of MuJoCo's headers that begin as its functions and macros do."""

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


class EngineTable(Struct, frozen=True, dict=True):
    """The names as they are kept: decoded when the first one is looked up."""

    data: bytes

    @functools.cached_property
    def names(self) -> EngineNames:
        return _decode(self.data)


@functools.lru_cache(maxsize=4)
def _decode(data: bytes) -> EngineNames:
    return msgspec.json.decode(data, type=EngineNames)


def engine_names(store: Store, interpreter: Interpreter | None) -> EngineTable:
    """The names of the MuJoCo that the scripts use.

    Raises:
        EffectError: MuJoCo cannot be loaded.
    """
    python = sys.executable if interpreter is None else interpreter.python
    engine = engine_version() if interpreter is None else interpreter.engine
    version = python_version() if interpreter is None else interpreter.version
    folders = sys.path if interpreter is None else interpreter.packages
    packages = [Path(folder) for folder in folders if folder.endswith("-packages")]
    states = [str(folder.stat().st_mtime_ns) for folder in packages if folder.is_dir()]
    files = (_PROGRAM, mjcf.__file__)
    code = [Path(file).read_text("utf-8") for file in files]
    key = key_of(engine, version, python, *states, *code)
    data = _in_memory.get(key) or store.get(_KIND, key, bytes)
    if data is None:
        data = msgspec.json.encode(list_names(python))
        store.put(_KIND, key, data)
    _in_memory[key] = data
    return EngineTable(data)


_in_memory: dict[str, bytes] = {}


def list_names(python: str) -> EngineNames:
    """List the names of the MuJoCo of an interpreter in a child process.

    Raises:
        EffectError: MuJoCo cannot be loaded.
    """
    with JsonChild(_PROGRAM, _SECONDS, python) as child:
        answer = child.ask(None)
        if answer is None:
            raise EffectError(f"listing the names of MuJoCo {child.death()}")
    elements = mjcf.read_schema(answer.pop("schema"))
    return msgspec.convert({**answer, "elements": elements}, EngineNames)


class KnownName(Struct, frozen=True):
    """What a name refers to."""

    href: str = ""
    """Its address: of another site, or that of a line (`#stem.L12`)."""
    text: str = ""
    """A declaration or signature, for an editor."""
    doc: str = ""
    extent: tuple[str, ...] = ()
    """The shape of an array."""
    engine: bool = False
    """Whether it is a name of MuJoCo or MJCF, which another version may have lost."""


class Unknown(Struct, frozen=True):
    """Why there is nothing of a name."""

    message: str
    help: str = ""
    part: str = ""
    """The part of the name that is wrong."""


Answer: TypeAlias = KnownName | Unknown | None
"""`None` means that nobody can say."""


def unknown(lead: str, name: str, names: Iterable[str]) -> Unknown:
    """Why a name is none of these; `lead` says whose these are."""
    return Unknown(f"{lead} `{name}`", did_you_mean(name, names), name)


def find_engine_name(engine: EngineNames, name: str) -> KnownName | None:
    """What a single name of MuJoCo means, as C or Python has it."""
    api = "APIreference/"
    if name in engine.functions:
        function = engine.functions[name]
        page = f"{api}APIfunctions.html#{name.lower().replace('_', '-')}"
        href = _MANUAL.format(engine.version, page) if name.startswith("mj") else ""
        return KnownName(href, function.text, function.doc, engine=True)
    enum = name if name in engine.enums else engine.enum_of.get(name)
    if enum is not None:
        href = _MANUAL.format(engine.version, f"{api}APItypes.html#{enum.lower()}")
        return KnownName(href, name, f"of `{enum}`" if enum != name else "", engine=True)
    if name in engine.constants:
        href = _MANUAL.format(engine.version, f"{api}APIglobals.html")
        return KnownName(href, f"{name} = {engine.constants[name]}", engine=True)
    for class_name in (name, f"Mj{name[2:]}"):
        if class_name in engine.classes and name[:2].lower() == "mj":
            return KnownName(class_href(engine, class_name), name, engine=True)
    classes = [c for c in engine.classes_of.get(name, ()) if c in ("MjModel", "MjData", "MjOption")]
    if classes and "_" in name:
        member = engine.classes[classes[0]][name]
        href = class_href(engine, classes[0])
        return KnownName(href, member.text, member.doc, member.extent, engine=True)
    if name in ("mjtNum", "mjtByte", "mjtSize", "mjtBool"):
        return KnownName(_MANUAL.format(engine.version, f"{api}APItypes.html#{name.lower()}"), name)
    return None


def class_href(engine: EngineNames, name: str) -> str:
    """The address of a class in MuJoCo's manual."""
    page = "python.html" if name.endswith("Views") else f"APIreference/APItypes.html#{name.lower()}"
    return _MANUAL.format(engine.version, page)


def element_href(engine: EngineNames, name: str, attribute: str = "") -> str:
    """The address of an element of MJCF in MuJoCo's manual, or of an attribute."""
    places = {p: a for p, a in engine.elements[name].items() if not attribute or attribute in a}
    places = {p: a for p, a in places.items() if p != "default"} or places
    parent = next(iter(places), "")
    if name in ("frame", "replicate", "worldbody") or parent in ("", "mujoco"):
        parent = ""
    target = "body" if name == "worldbody" else name
    anchor = "-".join(filter(None, (parent, target, attribute)))
    return _MANUAL.format(engine.version, f"XMLreference.html#{anchor}")


# --- coursebuild itself


@functools.cache
def options_by_command() -> dict[str, frozenset[str]]:
    """The commands of coursebuild and the options in their code, which is read and not run."""
    modules = {name: f"coursebuild.cli.{name}" for name in CORE_COMMANDS}
    modules |= {c.name: c.module for feature in features() for c in feature.commands}
    common = {"--help", "--version", *_options(["coursebuild.pipeline.arguments"])}
    options = {name: frozenset((*common, *_options([m]))) for name, m in modules.items()}
    return {**options, "help": frozenset(common)}


def _options(modules: Iterable[str]) -> Iterator[str]:
    for module in modules:
        spec = importlib.util.find_spec(module)
        if spec is None or spec.origin is None:
            continue
        file = Path(spec.origin)
        shared = file.parent.glob("*.py") if file.parent.name == "commands" else ()
        for path in (file, *shared):
            yield from re.findall(r'"(--[a-z][a-z-]*)"', path.read_text("utf-8"))


@functools.cache
def tables_of(root: type[Struct]) -> dict[str, frozenset[str]]:
    """The tables of a file, each with its keys; none where any may stand."""
    tables: dict[str, frozenset[str]] = {}

    def add(name: str, field_type: inspect.Type) -> None:
        match field_type:
            case inspect.StructType():
                if name in tables:
                    return  # it holds itself
                tables[name] = frozenset(field.encode_name for field in field_type.fields)
                for field in field_type.fields:
                    add(f"{name}.{field.encode_name}".lstrip("."), field.type)
            case inspect.UnionType():
                for inner in field_type.types:
                    add(name, inner)
            case inspect.VarTupleType():
                add(name, field_type.item_type)
            case inspect.Metadata():
                add(name, field_type.type)
            case inspect.DictType():
                tables[name] = frozenset()
            case _:
                pass

    add("", inspect.type_info(root))
    return tables


def resolve_command(manual: str, name: str) -> Answer:
    """What a command means, with its page of the manual."""
    known_names = options_by_command()
    lead = "coursebuild has no command"
    return KnownName(manual) if name in known_names else unknown(lead, name, known_names)


def resolve_option(manual: str, command: str, name: str) -> Answer:
    """What an option of a command, or of any, means, with its page of the manual."""
    commands = options_by_command()
    options = commands.get(command, frozenset[str]().union(*commands.values()))
    if name in options:
        return KnownName(manual)
    # Alone, it may be of another program.
    return unknown(f"`coursebuild {command}` has no option", name, options) if command else None


def resolve_table(manual: str, table: str, key: str) -> Answer:
    """What a table of the course map means, or a key of it, with its page of the manual."""
    name = table.lstrip("[")
    tables = tables_of(CourseFile)
    if name not in tables:
        return None  # it may be of another file
    if key and tables[name] and key not in tables[name]:
        return unknown(f"the table `{name}` of the course map has no key", key, tables[name])
    return KnownName(manual)
