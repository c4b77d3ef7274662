"""Check that code which lessons show from the project's files is what these files hold.

Entry points: `check_source_parts`, `shown_files`. A part is a function, a class or a method, with
its decorators, or the whole file. Indentation and white space at the ends of lines do not count.
"""

from __future__ import annotations

import ast
import contextlib
import textwrap
from collections.abc import Callable, Iterator

from coursebuild.core.model import Course, PlainCode, SourcePart, find_blocks
from coursebuild.core.scripts.edit import whole_lines
from coursebuild.core.scripts.failures import without_indentation
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean

ReadText = Callable[[str], str | None]
"""The text of a file of the project; `None` where there is none."""


def shown_files(course: Course) -> frozenset[str]:
    """The files of which lessons show parts."""
    return frozenset(source.path for _, source in _source_parts(course))


def check_source_parts(course: Course, read: ReadText) -> Iterator[Diagnostic]:
    """A diagnostic, with an edit, for each part that differs from its file."""
    for block, source in _source_parts(course):
        text = read(source.path)
        if text is None:
            yield diagnose("source-part", source.place, f"there is no text file `{source.path}`")
            continue
        parts = _read_parts(text)
        if source.part not in parts:
            message = f"`{source.path}` has no function or class `{source.part}`"
            help = did_you_mean(source.part, [name for name in parts if name])
            yield diagnose("source-part", source.place, message, help=help)
        elif parts[source.part] != (lesson_lines := _lines(block.code.text)):
            file_lines = parts[source.part]
            equalities = (a == b for a, b in zip(file_lines, lesson_lines, strict=False))
            first = next((i for i, equal in enumerate(equalities) if not equal), len(lesson_lines))
            code_lines = block.code.lines()
            span = (
                without_indentation(code_lines[first].span())
                if first < len(code_lines)
                else source.place
            )
            yield diagnose(
                "source-part",
                span,
                f"this differs from what `{source.path}` holds",
                label=f"it has `{file_lines[first].strip()}` here"
                if first < len(file_lines)
                else "",
                help="run `coursebuild update`, which copies it here",
                edits=[whole_lines(source.body_span, source.prefix, file_lines)],
            )


def _source_parts(course: Course) -> Iterator[tuple[PlainCode, SourcePart]]:
    for document in course.documents:
        for code in find_blocks(document, PlainCode):
            if code.source is not None:
                yield code, code.source


def _read_parts(text: str) -> dict[str, list[str]]:
    """The lines of each part of a file by name; the whole file has an empty name."""
    parts = {"": _lines(text)}
    rows = text.split("\n")

    def add_parts(nodes: list[ast.stmt], prefix: str) -> None:
        for node in nodes:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                start = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                name = f"{prefix}{node.name}"
                parts[name] = _lines("\n".join(rows[start - 1 : node.end_lineno]))
                add_parts(node.body, f"{name}.")

    with contextlib.suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        add_parts(ast.parse(text).body, "")
    return parts


def _lines(text: str) -> list[str]:
    return [line.rstrip() for line in textwrap.dedent(text).rstrip().split("\n")]
