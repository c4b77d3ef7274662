"""Code of the project's files that lessons show: is it what the files hold?

Entry point: `check_source_parts`. A part is a function, a class or a method, with its decorators;
without one it is the whole file. How far it is indented, and white space at the ends of lines, do
not count.
"""

from __future__ import annotations

import ast
import contextlib
import textwrap
from collections.abc import Callable, Iterator

from coursebuild.core.model import Course, PlainCode, SourcePart, document_blocks
from coursebuild.core.scripts.edit import whole_lines
from coursebuild.core.scripts.failures import without_indentation
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean

Read = Callable[[str], str | None]
"""The text of a file of the project; `None` where there is none."""


def shown_files(course: Course) -> frozenset[str]:
    """The files of which lessons show parts."""
    return frozenset(source.path for _, source in _shown(course))


def check_source_parts(course: Course, read: Read) -> Iterator[Diagnostic]:
    """A diagnostic for each part that is not what its file holds, with what it holds."""
    for block, source in _shown(course):
        text = read(source.path)
        if text is None:
            yield diagnose("source-part", source.place, f"there is no text file `{source.path}`")
            continue
        parts = _parts(text)
        if source.part not in parts:
            message = f"`{source.path}` has no function or class `{source.part}`"
            help = did_you_mean(source.part, [name for name in parts if name])
            yield diagnose("source-part", source.place, message, help=help)
        elif parts[source.part] != (shown := _lines(block.code.text)):
            held = parts[source.part]
            same = (one == other for one, other in zip(held, shown, strict=False))
            first = next((i for i, equal in enumerate(same) if not equal), len(shown))
            rows = block.code.lines()
            span = without_indentation(rows[first].span()) if first < len(rows) else source.place
            yield diagnose(
                "source-part",
                span,
                f"this is not what `{source.path}` holds",
                label=f"it has `{held[first].strip()}` here" if first < len(held) else "",
                help="run `coursebuild update`, which writes what it holds",
                edits=[whole_lines(source.body_span, source.prefix, held)],
            )


def _shown(course: Course) -> Iterator[tuple[PlainCode, SourcePart]]:
    for document in course.documents:
        for block in document_blocks(document):
            if isinstance(block, PlainCode) and block.source is not None:
                yield block, block.source


def _parts(text: str) -> dict[str, list[str]]:
    """The lines of each part of a file by its name; the whole file has an empty one."""
    parts = {"": _lines(text)}
    rows = text.split("\n")

    def take(nodes: list[ast.stmt], before: str) -> None:
        for node in nodes:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                start = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                name = f"{before}{node.name}"
                parts[name] = _lines("\n".join(rows[start - 1 : node.end_lineno]))
                take(node.body, f"{name}.")

    with contextlib.suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        take(ast.parse(text).body, "")
    return parts


def _lines(text: str) -> list[str]:
    return [line.rstrip() for line in textwrap.dedent(text).rstrip().split("\n")]
