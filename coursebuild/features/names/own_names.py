"""The names of coursebuild itself: commands with their options, and the keys that it reads.

Entry points: `options_by_command`; `tables_of` a kind of file, as the course map; `known_keys`; and
what a name of each sort means: `resolve_command`, `resolve_option`, `resolve_table`.
"""

from __future__ import annotations

import functools
import importlib.util
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.core.registry import CORE_COMMANDS, features
from coursebuild.core.syntax.course_schema import CourseFile, schema_roots
from coursebuild.core.text.diagnostics import did_you_mean, misspelt, nearest, propose
from coursebuild.features.names.engine import Answer, KnownName, Unknown


@functools.cache
def options_by_command() -> dict[str, frozenset[str]]:
    """The commands of coursebuild and the options in their code, which is read and not run."""
    modules = {name: f"coursebuild.cli.{name}" for name in CORE_COMMANDS}
    modules |= {c.name: c.module for feature in features() for c in feature.commands}
    common = {"--help", "--version", *_options(["coursebuild.cli.arguments"])}
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


@functools.cache
def known_keys() -> frozenset[str]:
    """The keys of everything that coursebuild reads: the course map, labs, quizzes."""
    tables = (tables_of(root) for root, _ in schema_roots().values())
    return frozenset(key for table in tables for keys in table.values() for key in keys)


def resolve_command(manual: str, name: str) -> Answer:
    """What a command means, with its page of the manual."""
    if name in options_by_command():
        return KnownName(manual)
    help = did_you_mean(name, options_by_command())
    return Unknown(f"coursebuild has no command `{name}`", help, name)


def resolve_option(manual: str, command: str, name: str) -> Answer:
    """What an option of a command, or of any, means, with its page of the manual."""
    commands = options_by_command()
    options = commands.get(command)
    if options is None:
        options = frozenset(option for options in commands.values() for option in options)
    if name in options:
        return KnownName(manual)
    if not command and nearest(name, options, cutoff=0.85) is None:
        return None  # of another program
    subject = f"`coursebuild {command}`" if command else "coursebuild"
    return Unknown(f"{subject} has no option `{name}`", did_you_mean(name, options), name)


def resolve_table(manual: str, table: str, key: str) -> Answer:
    """What a table of the course map means, or a key of it, with its page of the manual."""
    name = table.lstrip("[")
    tables = tables_of(CourseFile)
    if name not in tables:
        likely = misspelt(name, tables) if len(name) > 3 else None
        if likely is None:
            return None
        fix = propose(name, likely, tables)
        return Unknown(f"the course map has no table `{name}`", fix, name)
    if key and tables[name] and key not in tables[name]:
        help = did_you_mean(key, tables[name])
        return Unknown(f"the table `{name}` of the course map has no key `{key}`", help, key)
    return KnownName(manual)
