"""A module of a course as readers get it in a script: the definitions that are used of it.

Its names are those of the module itself, not those that functions, classes and comprehensions have
for themselves.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import cast

from msgspec import Struct

from coursebuild.core.text.python_code import python_nodes

DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


class NotOneFileError(Exception):
    """A script cannot be one file; the reason is a clause."""


class CourseModule(Struct, frozen=True):
    """A module of the course, or of `mjcourse`."""

    path: str
    """As readers are told where its code comes from."""
    text: str


class ModuleCode:
    """A module's statements by the names that they bind at its top level."""

    def __init__(self, name: str, source: CourseModule) -> None:
        self.name, self.source = name, source
        self.lines = source.text.split("\n")
        self.statements, self.numbers = _read(source.text)
        self.needed: set[int] = set()
        self.uses: dict[str, None] = {}
        """The modules whose definitions those of this one need, by their names."""
        self.new_names: dict[str, str] = {}
        """What the file calls otherwise than the module does."""

    def imported(self, statement: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, str, str]]:
        """The name that each import binds, its module and its name there, empty for all of it."""
        for alias in statement.names:
            if isinstance(statement, ast.Import):
                yield bound_name(alias), alias.name, ""
                continue
            package = self.name.split(".")
            if not self.source.path.endswith("__init__.py"):
                package = package[:-1]
            package = package[: len(package) - statement.level + 1] if statement.level else []
            module = ".".join(filter(None, (*package, statement.module or "")))
            yield alias.asname or alias.name, module, alias.name

    def statement_of(self, name: str) -> ast.stmt:
        """The only statement that binds a name."""
        numbers = self.numbers.get(name, ())
        if len(numbers) != 1:
            problem = "binds `{}` more than once" if numbers else "has no `{}`"
            raise NotOneFileError(f"{self.source.path} {problem.format(name)}")
        return self.statements[numbers[0]]

    def check(self) -> None:
        """Refuse a module that does something when it is imported."""
        for statement in self.statements:
            # What stands below `if __name__ == …` is for the module as a script only.
            defines = isinstance(statement, (*DEFINITIONS, ast.Import, ast.ImportFrom))
            assigns = isinstance(statement, ast.Assign | ast.AnnAssign)
            if not (
                defines
                or (assigns and bound_names(statement))
                or is_text(statement)
                or (isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test))
            ):
                message = (
                    f"{self.source.path} does more than define names (line {statement.lineno})"
                )
                raise NotOneFileError(message)

    def code(self) -> str:
        """The needed definitions with the comments above them, as they stand there."""
        text, is_first, was_short = "", True, False
        for number in sorted(self.needed):
            piece = self._piece(self.statements[number])
            is_short = "\n" not in piece
            text += "" if is_first else "\n" if is_short and was_short else "\n\n\n"
            text += piece
            is_first, was_short = False, is_short
        return text

    def _piece(self, statement: ast.stmt) -> str:
        first = first_line(statement)
        lines = [line.encode() for line in self.lines[: statement.end_lineno]]
        for line, column, old, new in sorted(self._renamings(statement), reverse=True):
            row = lines[line - 1]
            lines[line - 1] = row[:column] + new.encode() + row[column + len(old.encode()) :]
        while first > 1 and lines[first - 2].startswith(b"#"):
            first -= 1
        return b"\n".join(lines[first - 1 :]).decode()

    def _renamings(self, statement: ast.stmt) -> Iterator[tuple[int, int, str, str]]:
        """Line and column of each name in a statement that the file calls otherwise."""
        for node in global_names(statement):
            if node.id in self.new_names:
                yield node.lineno, node.col_offset, node.id, self.new_names[node.id]
        if isinstance(statement, DEFINITIONS) and statement.name in self.new_names:
            row = self.lines[statement.lineno - 1]
            match = re.match(r"\s*(?:async\s+def|def|class)\s+", row)
            assert match is not None
            at = len(match[0].encode())
            yield statement.lineno, at, statement.name, self.new_names[statement.name]


@functools.lru_cache(maxsize=256)
def _read(text: str) -> tuple[Sequence[ast.stmt], Mapping[str, Sequence[int]]]:
    """A module's statements, and the numbers of those that bind a name: many scripts share one."""
    nodes, numbers = python_nodes(text), dict[str, list[int]]()
    if not nodes:
        raise NotOneFileError("Python cannot read it")
    statements = cast(ast.Module, nodes[0]).body
    for number, statement in enumerate(statements):
        for bound in bound_names(statement):
            numbers.setdefault(bound, []).append(number)
    return statements, numbers


def bound_name(alias: ast.alias) -> str:
    """The name that an import binds."""
    return alias.asname or alias.name.partition(".")[0]


def bound_names(statement: ast.stmt) -> tuple[str, ...]:
    """The names that a statement binds, without those inside of functions and classes."""
    return () if is_future(statement) else tuple(sorted(_scope_names([statement])))


def global_names(node: ast.AST, hidden: frozenset[str] = frozenset()) -> Iterator[ast.Name]:
    """The names below a node that are of the module, not of a function or comprehension."""
    outer: list[ast.AST] = []
    match node:
        case ast.Name():
            if node.id not in hidden:
                yield node
            return
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
            arguments = node.args
            outer = [arg.annotation for arg in _arguments(arguments) if arg.annotation is not None]
            outer += [*arguments.defaults, *filter(None, arguments.kw_defaults)]
            inner: list[ast.AST] = [node.body] if isinstance(node, ast.Lambda) else [*node.body]
            if not isinstance(node, ast.Lambda):
                outer += [*node.decorator_list, *([node.returns] if node.returns else [])]
            parts = (part for child in inner for part in ast.walk(child))
            shared = {n for part in parts if isinstance(part, ast.Global) for n in part.names}
            local = {arg.arg for arg in _arguments(arguments)} | _scope_names(inner)
            inside = hidden | (local - shared)
        case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
            inner = list(ast.iter_child_nodes(node))
            inside = hidden | _scope_names([generator.target for generator in node.generators])
        case _:
            inner, inside = list(ast.iter_child_nodes(node)), hidden
    for child in outer:
        yield from global_names(child, hidden)
    for child in inner:
        yield from global_names(child, inside)


def _arguments(arguments: ast.arguments) -> list[ast.arg]:
    variadic = (arguments.vararg, arguments.kwarg)
    positional = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [*positional, *(arg for arg in variadic if arg is not None)]


def _scope_names(nodes: Iterable[ast.AST]) -> frozenset[str]:
    """The names that are bound below these nodes, in the same scope."""
    names: set[str] = set()
    stack = list(nodes)
    while stack:
        node = stack.pop()
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                names.add(node.name)
                continue
            case (
                ast.Lambda() | ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp()
            ):
                continue
            case ast.Import() | ast.ImportFrom():
                names |= {*map(bound_name, node.names)}
            case ast.ExceptHandler() if node.name:
                names.add(node.name)
            case ast.Name(ctx=ast.Store()):
                names.add(node.id)
            case _:
                pass
        stack += ast.iter_child_nodes(node)
    return frozenset(names)


def first_line(statement: ast.stmt) -> int:
    """The number of a statement's first line, which may be that of a decorator."""
    decorators = statement.decorator_list if isinstance(statement, DEFINITIONS) else []
    return min([statement.lineno, *(node.lineno for node in decorators)])


def is_text(statement: ast.stmt) -> bool:
    """Whether it is a constant that nothing takes, such as a docstring."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def is_future(statement: ast.stmt) -> bool:
    """Whether it imports a feature of Python's future."""
    return isinstance(statement, ast.ImportFrom) and statement.module == "__future__"


def futures(statements: Iterable[ast.stmt]) -> Iterator[str]:
    """The features of Python's future that a module uses."""
    for statement in statements:
        if isinstance(statement, ast.ImportFrom) and is_future(statement):
            yield from (alias.name for alias in statement.names)
