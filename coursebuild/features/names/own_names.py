"""The names of coursebuild itself: commands with their options, and the keys that it reads.

Entry points: `options_by_command`; `tables_of` a kind of file, as the course map; `known_keys`.
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
from coursebuild.core.syntax.schemas import schema_roots


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
