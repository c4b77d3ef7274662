"""What is wrong with Python before it runs: its syntax, and windows that it opens."""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator, Sequence
from functools import lru_cache

from coursebuild.core.text.diagnostics import Diagnostic, Edit, Fix, diagnose
from coursebuild.core.text.python_code import python_nodes
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

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
    error = _compile_error(code.text)
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

    if isinstance(error, IndentationError) and (mixed := _diagnose_mixed_tab(rows)) is not None:
        yield mixed
        return
    message, _, help = _LINE_REFERENCE.sub(lesson_line, error.msg).partition(". ")
    if row.text.lstrip().startswith(("%", "!")):
        help = f"`{row.text.split()[0]}` is a command of Jupyter: leave it out"
    message, place = _lower_first(message), row.span(start, end)
    fix = Fix(_lower_first(help), edits=_python_edits(row, message, place), safe=True)
    yield diagnose("python-syntax", place, message, help=fix)


_PYTHON_CHARACTERS = {**dict.fromkeys("“”„", '"'), **dict.fromkeys("‘’", "'")} | {
    **{"\u2212": "-", "×": "*", "÷": "/", "·": "*", "\xa0": " ", "，": ",", "\u200b": ""}
}
"""Characters of texts, and what Python has for them."""


def _python_edits(row: Excerpt, message: str, place: Span) -> tuple[Edit, ...]:
    start = Span(place.source, place.start, place.start)
    if message == "expected ':'":
        return (Edit(start, ":"),)
    if re.match(r"invalid (?:non-printable )?character ", message):
        char, at = place.text[:1], row.text.find(place.text[:1]) + 1
        new = _PYTHON_CHARACTERS.get(char)
        end = re.search("[“”‘’]", row.text[at:]) if new in ('"', "'") else None
        places = [at - 1, *([] if end is None else [at + end.start()])]
        return tuple(Edit(row.span(p, p + 1), new) for p in places if new is not None)
    printed = re.fullmatch(r"(\s*print) (?!\()([^#]*\S)\s*", row.text)
    if message.startswith("missing parentheses in call to 'print'") and printed is not None:
        return (Edit(row.span(printed.end(1), printed.end(2)), f"({printed[2]})"),)
    return ()


def _diagnose_mixed_tab(rows: Sequence[Excerpt]) -> Diagnostic | None:
    """The diagnostic of the first tab before code of which other lines are indented by blanks."""
    leads = [row.text[: len(row.text) - len(row.text.lstrip())] for row in rows]
    tab = next(
        (
            row.span(at := lead.index("\t"), at + 1)
            for row, lead in zip(rows, leads, strict=True)
            if "\t" in lead
        ),
        None,
    )
    if tab is None or not any(lead.startswith(" ") for lead in leads):
        return None
    width = min((len(lead) for lead in leads if lead and "\t" not in lead), default=4)
    new_leads = [lead.replace("\t", " " * width) for lead in leads]
    lines = [new + row.text.lstrip() for new, row in zip(new_leads, rows, strict=True)]
    edits: tuple[Edit, ...] = ()
    if _compile_error("\n".join(lines)) is None:
        pairs = zip(rows, leads, new_leads, strict=True)
        edits = tuple(Edit(row.span(0, len(a)), b) for row, a, b in pairs if a != b)
    message = "this line is indented by a tab, and others by blanks"
    fix = Fix("indent all lines by blanks", edits=edits, safe=True)
    return diagnose("python-syntax", tab, message, help=fix)


def _lower_first(sentence: str) -> str:
    """A sentence of Python as part of ours: without its capital, unless that is a name."""
    if sentence[1:2].islower():
        return sentence[:1].lower() + sentence[1:]
    return sentence


@lru_cache(maxsize=64)
def _compile_error(code: str) -> SyntaxError | None:
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
