"""The syntax tree of Python texts."""

from __future__ import annotations

import ast
import functools
import warnings


def find_imports(code: str) -> frozenset[str]:
    """The top-level modules that a Python text imports; none if it does not parse."""
    modules: set[str] = set()
    for node in python_nodes(code):
        if type(node) is ast.Import:
            modules.update(alias.name.partition(".")[0] for alias in node.names)
        elif type(node) is ast.ImportFrom and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return frozenset(modules)


def python_nodes(code: str) -> tuple[ast.AST, ...]:
    """All nodes of a Python text, the module first, level by level; none if it does not parse."""
    return _nodes(code.rstrip("\n"))


@functools.lru_cache(maxsize=8)
def _nodes(code: str) -> tuple[ast.AST, ...]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return tuple(ast.walk(ast.parse(code, "")))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ()
