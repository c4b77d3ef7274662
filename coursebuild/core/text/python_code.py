"""Python texts: their syntax tree, or why they have none."""

from __future__ import annotations

import ast
import functools
import warnings


@functools.lru_cache(maxsize=1024)
def find_imports(code: str) -> frozenset[str]:
    """The top-level modules that a Python text imports; none if it does not parse."""
    modules: set[str] = set()
    for node in _statements(code):
        if type(node) is ast.Import:
            modules.update(alias.name.partition(".")[0] for alias in node.names)
        elif type(node) is ast.ImportFrom and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return frozenset(modules)


def python_nodes(code: str) -> tuple[ast.AST, ...]:
    """All nodes of a Python text, the module first, level by level; none if it does not parse."""
    return _nodes(code.rstrip("\n"))


def _statements(code: str) -> list[ast.AST]:
    """The statements of a Python text and what they consist of, but for expressions."""
    tree = _tree(code.rstrip("\n"))
    nodes: list[ast.AST] = [] if tree is None else [tree]
    for node in nodes:
        for field in ("body", "orelse", "finalbody", "handlers", "cases"):
            nodes += getattr(node, field, ())
    return nodes


def bound_name(node: ast.AST) -> str | None:
    """The name to which a node gives a meaning, if it does; `*` for all names of a module."""
    match node:
        case ast.Name():
            return node.id if isinstance(node.ctx, ast.Store) else None
        case ast.alias():
            return node.asname or node.name.partition(".")[0]
        case ast.arg():
            return node.arg
        case ast.MatchMapping():
            return node.rest
        case _:  # a function, a class, an exception, a part of a pattern, a parameter of a type
            name = getattr(node, "name", None)
            return name if isinstance(name, str) else None


@functools.lru_cache(maxsize=8)
def _nodes(code: str) -> tuple[ast.AST, ...]:
    tree = _tree(code)
    return () if tree is None else tuple(ast.walk(tree))


@functools.lru_cache(maxsize=8)
def _tree(code: str) -> ast.Module | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(code, "")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


@functools.lru_cache(maxsize=64)
def compile_error(code: str) -> SyntaxError | None:
    """The first error of Python in a text; kept, as a preview parses unchanged blocks again."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(code, "", "exec", dont_inherit=True)
    except SyntaxError as error:
        return error.with_traceback(None)
    except (ValueError, MemoryError, RecursionError, OverflowError) as error:
        message = f"the code cannot be compiled: {error}"
        syntax_error = SyntaxError(message if str(error) else "the code is nested too deeply")
        syntax_error.end_offset = 1
        return syntax_error
    return None
