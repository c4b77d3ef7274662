"""What is wrong with Python before it runs: its syntax, and windows that it opens."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.python_code import compile_error, python_nodes
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

_LINE_REFERENCE = regex(r"\b(on|at) line ([0-9]+)")
_SHOWS = regex(r"(?:matplotlib\.pyplot|plotly\.io)\.show")


def find_windows(code: Excerpt) -> Iterator[Diagnostic]:
    """Report the first picture that a script without figures shows and does not save."""
    if not re.search("matplotlib|plotly", code.text):
        return
    nodes = python_nodes(code.text)
    names: dict[str, str] = {}
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {a.asname: a.name for a in node.names if a.asname}
        elif isinstance(node, ast.ImportFrom):
            names |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    for call in nodes:
        if not isinstance(call, ast.Call):
            continue
        name = ast.unparse(call.func)
        first, dot, rest = name.partition(".")
        if _SHOWS.fullmatch(f"{names.get(first, first)}{dot}{rest}"):
            row = code.lines()[call.lineno - 1]
            at = max(row.text.find(name), 0)
            message = f"`{name}` opens a window, so the page has no figure"
            help = (
                'save it, `plt.savefig("x.svg")`, say `figure=x.svg` on the fence, and write '
                "`Figure: what it shows` below"
            )
            yield diagnose("figure-window", row.span(at, at + len(name)), message, help=help)
            return


def check_syntax(code: Excerpt) -> Iterator[Diagnostic]:
    """Report where and why a script does not parse, if it does not."""
    error = compile_error(code.text)
    if error is None:
        return
    rows = code.lines()
    line = min(error.lineno or 1, len(rows))
    row = rows[line - 1]
    start = min(max((error.offset or 1) - 1, 0), len(row.text))
    indentation = len(row.text) - len(row.text.lstrip())
    start = max(start, indentation)  # Python may point into the white space before the code
    end = len(row.text)
    if error.end_lineno in (None, error.lineno):
        end = max((error.end_offset or 0) - 1, 0)
    end = max(start, min(max(end, start + 1), len(row.text)))

    def lesson_line(match: re.Match[str]) -> str:
        return f"{match[1]} line {rows[int(match[2]) - 1].span().line}"

    message, _, help = _LINE_REFERENCE.sub(lesson_line, error.msg).partition(". ")
    if row.text.lstrip().startswith(("%", "!")):
        help = f"`{row.text.split()[0]}` is a command of Jupyter: leave it out"
    place, message, help = row.span(start, end), _lower_first(message), _lower_first(help)
    yield diagnose("python-syntax", place, message, help=help)


def _lower_first(sentence: str) -> str:
    """A sentence of Python as part of ours: without its capital, unless that is a name."""
    if sentence[1:2].islower():
        return sentence[:1].lower() + sentence[1:]
    return sentence
