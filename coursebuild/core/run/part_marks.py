"""Marks in the output of a script that say where one of its parts ends and the next begins.

A part is whole statements of the script's one module. Between two parts, its code calls a mark.
This call is compiled into the code and has no name: a script finds nothing new in its modules, and
the lines of its frames are those of its file.

A mark comes after all bytes that the process has written so far, also those that Python and the C
library have kept back. What other processes and threads print counts for the part during which it
arrives. A mark is written where the output went at the start, wherever it goes now.
"""

from __future__ import annotations

import ast
import contextlib
import ctypes
import fcntl
import os
import select
import sys
from collections.abc import Sequence
from types import CodeType

_FIRST_FD = 64
"""A script finds the small numbers of descriptors free."""


class PartMark:
    """Writes a mark into this process's output."""

    def __init__(self, mark: bytes) -> None:
        self.name = mark.hex()
        self._mark = mark
        self._fd = fcntl.fcntl(1, fcntl.F_DUPFD_CLOEXEC, _FIRST_FD)
        self._process = os.getpid()
        self._flush_c_streams = ctypes.CDLL(None).fflush

    def write(self) -> None:
        """Write it, after all that was printed before; not in a copy of the process."""
        if os.getpid() != self._process:
            return
        for stream in (sys.stdout, sys.__stdout__):
            with contextlib.suppress(Exception):  # a script's own, or closed
                stream.flush()  # type: ignore[union-attr]
        self._flush_c_streams(None)
        with contextlib.suppress(OSError, ValueError):
            select.select([], [self._fd], [])  # a script may have said that writing must not wait
            os.write(self._fd, self._mark)


def compile_parts(text: bytes, path: str, lines: Sequence[int], mark: PartMark) -> CodeType:
    """The code of a script that writes a mark before each part that begins at one of `lines`."""
    tree = compile(text, path, "exec", ast.PyCF_ONLY_AST, dont_inherit=True)
    assert isinstance(tree, ast.Module)
    body = tree.body
    head = sum(map(_is_head, body, range(len(body))))
    for line in reversed(lines):
        at = next((i for i, node in enumerate(body) if _first_line(node) >= line), len(body))
        (call,) = ast.parse("''.write()").body
        for node in ast.walk(call):
            if isinstance(node, ast.Constant):
                node.value = mark.name  # in its place comes the mark itself, which no tree can hold
            if isinstance(node, ast.expr | ast.stmt):
                node.lineno, node.end_lineno = line, line
        body.insert(max(at, head), call)
    code = compile(tree, path, "exec", dont_inherit=True)
    constants = (mark if constant == mark.name else constant for constant in code.co_consts)
    return code.replace(co_consts=tuple(constants))


def _is_head(statement: ast.stmt, index: int) -> bool:
    """Whether it is the docstring, or an import of a feature, before which nothing may stand."""
    if isinstance(statement, ast.ImportFrom):
        return statement.module == "__future__"
    is_text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return index == 0 and is_text


def _first_line(statement: ast.stmt) -> int:
    decorators = getattr(statement, "decorator_list", ())
    return int(min([statement.lineno, *(node.lineno for node in decorators)]))


def split_output(data: bytes, mark: bytes) -> tuple[bytes, tuple[int, ...]]:
    """The output without its marks, and where they stood in it."""
    parts = data.split(mark)
    sizes = [sum(map(len, parts[: number + 1])) for number in range(len(parts) - 1)]
    return b"".join(parts), tuple(sizes)
