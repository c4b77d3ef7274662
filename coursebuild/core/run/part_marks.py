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
from itertools import pairwise
from types import CodeType

_FIRST_FD = 64
"""A script finds the small numbers of descriptors free."""


class PartMark:
    """Writes a mark into this process's output, and notes the parts that fail."""

    def __init__(self, mark: bytes) -> None:
        self.name = mark.hex()
        self._mark = mark
        self._fd = fcntl.fcntl(1, fcntl.F_DUPFD_CLOEXEC, _FIRST_FD)
        self._process = os.getpid()
        self._flush_c_streams = ctypes.CDLL(None).fflush
        self._has_failures = False

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

    def note_failure(self) -> None:
        """Write why a part fails, and where, to standard error; what ends a script goes on."""
        error = sys.exception()
        if not isinstance(error, Exception):
            raise
        self._has_failures = True
        line = error.__traceback__.tb_lineno if error.__traceback__ is not None else 0
        text = type(error).__name__
        with contextlib.suppress(Exception):  # an error of the script's own may do anything
            text = f"{text}: {error}".strip(": ").splitlines()[0]
            sys.stderr.flush()
        os.write(2, f"\n{FAILURE} {line}\n{text}\n".encode("utf-8", "backslashreplace"))

    def end(self) -> None:
        """End the script: it has failed where a part has."""
        if self._has_failures:
            raise SystemExit(1)


FAILURE = "this part fails at line"
"""What begins a note on a failure: the line behind it, then the error on a line of its own."""


def compile_parts(
    text: bytes, path: str, lines: Sequence[int], mark: PartMark, *, keeps_going: bool = False
) -> CodeType:
    """The code of a script that writes a mark before each part that begins at one of `lines`.

    `keeps_going`: after a part that fails, it goes on with the next; after an import that fails,
    with what stands below it.
    """
    tree = compile(text, path, "exec", ast.PyCF_ONLY_AST, dont_inherit=True)
    assert isinstance(tree, ast.Module)
    body = tree.body
    head = sum(map(_is_head, body, range(len(body))))
    starts = (
        next((i for i, node in enumerate(body) if _first_line(node) >= line), len(body))
        for line in lines
    )
    edges = [head, *(max(start, head) for start in starts), len(body)]
    new_body = body[:head]
    for number, (start, end) in enumerate(pairwise(edges)):
        if number:
            new_body += _statements("''.write()", lines[number - 1], mark)
        part = body[start:end]
        if part and keeps_going:
            for index, statement in enumerate(part):
                if isinstance(statement, ast.Import | ast.ImportFrom):
                    part[index] = _guard([statement], mark)
            part = [_guard(part, mark)]
        new_body += part
    if keeps_going:
        new_body += _statements("''.end()", text.count(b"\n") + 1, mark)
    tree.body = new_body
    code = compile(tree, path, "exec", dont_inherit=True)
    constants = (mark if constant == mark.name else constant for constant in code.co_consts)
    return code.replace(co_consts=tuple(constants))


def _guard(statements: Sequence[ast.stmt], mark: PartMark) -> ast.stmt:
    """These statements, with a note where they fail."""
    template = "try: pass\nexcept: ''.note_failure()"
    (guard,) = _statements(template, statements[0].lineno, mark)
    assert isinstance(guard, ast.Try)
    guard.body = [*statements]
    return guard


def _statements(template: str, line: int, mark: PartMark) -> list[ast.stmt]:
    """Statements at a line, with the name of the mark for each text.

    In its place comes the mark itself, which no tree can hold.
    """
    statements = ast.parse(template).body
    for statement in statements:
        for node in ast.walk(statement):
            if isinstance(node, ast.Constant):
                node.value = mark.name
            if isinstance(node, ast.expr | ast.stmt | ast.excepthandler):
                node.lineno, node.end_lineno = line, line
    return statements


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
