"""What code may notice of a model: what cannot be ruled out counts as a use.

Entry points: `python_reader(path, text, own)`, `Reader`, `Readers`.

1. Nobody's code is understood. Its syntax tree says which fields it asks anything for, which things
   it asks for by a complete literal, and of which kinds it may ask for any thing: by an argument
   that is no such literal, by a number, or by a function that is handed on.
2. Whoever could get at a field without naming it may use everything: by reflection, by a module
   that is not known to leave models alone, by a function of MuJoCo's that takes numbers of things
   or does not simulate, by reading or including the model's file.
3. Which fields tell a smaller model from the whole one is found by comparing both (`differences`):
   a reader notices it where it asks for one of these.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Collection, Sequence

import mujoco
from msgspec import Struct

from coursebuild.numerics.pruning.differences import VIEWS, ModelDifference

_LEAVE_MODELS_ALONE = frozenset(
    "__future__ bisect collections colorsys copy csv dataclasses datetime decimal enum fractions"
    " functools heapq itertools json math matplotlib mjcourse mpmath mujoco numbers numpy pathlib"
    " random scipy statistics sys textwrap time typing warnings".split(" ")
)
"""Modules that ask a model that they are given for nothing."""
_REFLECTION = frozenset(
    "__import__ breakpoint compile delattr dir eval exec getattr globals hasattr locals open"
    " setattr vars".split(" ")
)
_GET = frozenset(("delattr", "getattr", "hasattr", "setattr"))
_FILES = frozenset(
    "fromfile genfromtxt glob iterdir listdir load loadtxt modules open read_bytes read_text"
    " rglob scandir walk".split(" ")
)
"""By which the file of a model, or names of things, could be read."""
_OF_BODIES = ("bodyid", "parentid", "rootid", "weldid", "treeid", "mocapid", "jntid", "dofid")
_REFERENCES = frozenset(
    name
    for name in dir(mujoco.MjModel)
    if "_" in name and name.endswith("id") and not name.endswith(_OF_BODIES)
)
"""Fields that hold numbers of things other than bodies and joints."""
_WORD = re.compile(r"[^\W\d]\w*")
_INCLUDES = re.compile(r"<[^>]*\bfile\s*=")


class Reader(Struct, frozen=True):
    """What code asks a model for."""

    path: str
    names: frozenset[str] = frozenset()
    """Complete literals: things may be called so."""
    fields: frozenset[str] = frozenset()
    """That it asks anything for."""
    parts: frozenset[tuple[str, str]] = frozenset()
    """That it asks one thing for that it names, by the kind of the thing."""
    kinds: frozenset[str] = frozenset()
    """Of which it may ask for any thing."""
    opaque: str = ""
    """Why it may use everything; empty where it does not."""

    def notices(
        self, names: Collection[str], kinds: Collection[str], change: ModelDifference
    ) -> bool:
        """Whether it may notice that things of these names and kinds are gone."""
        parts = {part for _, part in change.parts}
        return bool(
            self.opaque
            or not self.names.isdisjoint(names)
            or not self.kinds.isdisjoint(kinds)
            or not self.fields.isdisjoint(change.fields | parts)
            or not self.parts.isdisjoint(change.parts)
            or self.touches(_REFERENCES)
        )

    def touches(self, fields: Collection[str]) -> bool:
        """Whether it may change one of these fields of a model, for one thing or for all."""
        split = [field.partition("_") for field in fields]
        ends = {end for _, _, end in split} - {""}
        of_one = {(VIEWS.get(prefix, ""), end) for prefix, _, end in split}
        return bool(
            self.opaque
            or not self.fields.isdisjoint(ends | set(fields))
            or not self.parts.isdisjoint(of_one)
        )


class Readers(Struct, frozen=True):
    """All code that uses a model, or may."""

    files: tuple[Reader, ...] = ()

    def noticing(
        self, names: Collection[str], kinds: Collection[str], change: ModelDifference
    ) -> Reader | None:
        """The first who may notice that things are gone."""
        return next((one for one in self.files if one.notices(names, kinds, change)), None)

    def touching(self, fields: Collection[str]) -> Reader | None:
        """The first who may change one of these fields."""
        return next((one for one in self.files if one.touches(fields)), None)


def python_reader(path: str, text: str, own: Collection[str] = ()) -> Reader:
    """What a Python file asks models for; `own` are modules that are read themselves."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return Reader(path, opaque="it is no Python")
    found = _PythonUse(own)
    found.visit(tree)
    return Reader(
        path,
        frozenset(found.names),
        frozenset(found.fields),
        frozenset(found.parts),
        frozenset(found.kinds),
        found.opaque,
    )


class _PythonUse(ast.NodeVisitor):
    def __init__(self, own: Collection[str]) -> None:
        self.own = own
        self.names: set[str] = set()
        self.fields: set[str] = set()
        self.parts: set[tuple[str, str]] = set()
        self.kinds: set[str] = set()
        self.opaque = ""

    def visit_Constant(self, node: ast.Constant) -> None:
        """A string may name a thing; a bytes object too."""
        value = node.value.decode("latin-1") if isinstance(node.value, bytes) else node.value
        if isinstance(value, str):
            self.names.add(value)
            if _INCLUDES.search(value):
                self.opaque = "it puts models together from files"

    def visit_Import(self, node: ast.Import) -> None:
        """A module that is imported."""
        for alias in node.names:
            self._module(alias.name)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        """A module of which something is imported."""
        module = node.module or ""
        self._module(module)
        for alias in node.names:
            (self._member if module.startswith("mujoco") else self._field)(alias.name)

    def _module(self, name: str) -> None:
        first, *rest = name.split(".")
        if first not in _LEAVE_MODELS_ALONE and first not in self.own:
            self.opaque = f"it imports {first}"
        for part in rest:
            (self._member if first == "mujoco" else self._field)(part)

    def visit_MatchClass(self, node: ast.MatchClass) -> None:
        """A pattern asks for fields."""
        self.fields.update(node.kwd_attrs)
        if node.patterns:
            self.opaque = "it matches patterns by their place"
        self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> None:
        """A name on which code runs that is not here."""
        hidden = node.id.startswith("__") and node.id not in ("__doc__", "__file__", "__name__")
        if node.id in _REFLECTION or hidden:
            self.opaque = f"it uses `{node.id}`"
        elif hasattr(mujoco, node.id):
            self._member(node.id)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        """A field of anything; of one thing that is named, only of that."""
        kind = _named(node.value)
        if kind is not None:
            self.parts.add((kind, node.attr))
            self._arguments(node.value)
        else:
            self._field(node.attr)
            self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        """A function of MuJoCo's, a format that asks for fields, or reflection with a literal."""
        function, name = node.func, getattr(node.func, "attr", getattr(node.func, "id", ""))
        kinds = _uses(name)
        given = [one for one in node.args if _is_number_of_named(one)]
        if isinstance(function, ast.Name) and name in _GET and _is_literal(node.args[1:2]):
            self._field(node.args[1].value)  # type: ignore[attr-defined]
            self._arguments(node)
        elif name in ("format", "format_map") and _is_literal([getattr(function, "value", None)]):
            self.fields.update(_WORD.findall(function.value.value))  # type: ignore[attr-defined]
            self._arguments(node)
        elif kinds and len(given) == len(kinds):
            for one in given:
                self._arguments(one.value)  # type: ignore[attr-defined]
            self._arguments(ast.Call(function, [one for one in node.args if one not in given], []))
        else:
            self.generic_visit(node)

    def _arguments(self, call: ast.expr) -> None:
        """What stands in a call, but not what is called."""
        assert isinstance(call, ast.Call)
        inner = call.func.value if isinstance(call.func, ast.Attribute) else None
        for part in (inner, *call.args, *call.keywords):
            if part is not None:
                self.visit(part)

    def _field(self, name: str) -> None:
        self.fields.add(name)
        if name in VIEWS:
            self.kinds.add(VIEWS[name])
        if name in _FILES:
            self.opaque = f"it uses `{name}`, and may read the model's file, or names"
        elif name.startswith("__") or name in ("format", "format_map"):
            self.opaque = f"it uses `{name}`"
        elif hasattr(mujoco, name):
            self._member(name)

    def _member(self, name: str) -> None:
        kinds = _uses(name)
        if kinds is None:
            self.opaque = f"it uses `{name}`"
        else:
            self.kinds.update(kinds)


def _named(node: ast.AST) -> str | None:
    """The kind of the one thing that a call asks for by a complete literal."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return None
    return VIEWS.get(node.func.attr) if _is_literal(node.args) and not node.keywords else None


def _is_literal(given: Sequence[ast.expr | None]) -> bool:
    """Whether something is a complete literal, and nothing else is given."""
    return [type(getattr(one, "value", None)) for one in given] == [str] and isinstance(
        given[0], ast.Constant
    )


def _is_number_of_named(node: ast.expr) -> bool:
    """Whether it is the number of a thing that is named: `model.key("up").id`."""
    return isinstance(node, ast.Attribute) and node.attr == "id" and _named(node.value) is not None


@functools.cache
def _uses(name: str) -> tuple[str, ...] | None:
    """The kinds of which a function of MuJoCo's takes numbers; `None` where it may do anything."""
    member = getattr(mujoco, name, None)
    if name in ("MjModel", "MjData") or name.startswith("mjt") or isinstance(member, int | float):
        return ()
    found: list[str] = []
    said = getattr(member, "__doc__", "") or ""
    lines = re.findall(rf"^(?:\d+\. )?({name}\(.*\)) -> (.*)$", said, re.M)
    if not lines:
        return None
    for line, gives in lines:
        if gives != "None" and re.search("MjModel|MjData", line):
            return None  # what is told of the whole
        (function,) = ast.parse(f"def {line}: ...").body
        assert isinstance(function, ast.FunctionDef)
        for argument in function.args.args:
            kind = _argument_use(argument)
            if kind is None:
                return None
            found.append(kind)
    return tuple(filter(None, found))


def _argument_use(argument: ast.arg) -> str | None:
    """The kind of which an argument is a number; empty for none, `None` for anything."""
    given = ast.unparse(argument.annotation) if argument.annotation is not None else ""
    if "SupportsInt" in given and argument.arg != "nstep":
        return VIEWS.get(argument.arg.rstrip("12"))
    known = ("MjModel", "MjData", "NDArray", "SupportsFloat", "SupportsInt")
    return "" if any(word in given for word in known) else None
