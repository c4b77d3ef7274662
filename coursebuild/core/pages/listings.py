"""Code as HTML, and what Python code imports.

tree-sitter reads Python, the language of most code, eight times as fast as Pygments, which reads
the other languages. It also reads code that does not parse, such as a fragment or a mistake that a
lesson makes on purpose. The many kinds of tokens are mapped to few classes.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from html import escape
from itertools import pairwise

import tree_sitter_python
from markupsafe import Markup
from tree_sitter import Language, Parser, Query, QueryCursor

from coursebuild.core.text.characters import visible
from coursebuild.core.text.regex import regex

_KEYWORDS = """
    and as assert async await break case class continue def del elif else except finally for from
    global if import in is lambda match nonlocal not or pass raise return try type while with yield
"""
_QUERY = """
    [(string_start) (string_content) (string_end) (format_specifier)] @s
    (expression_statement . (string [(string_start) (string_content) (string_end)] @d) .)
    (interpolation ["{" "}" (type_conversion)] @i)
    (format_specifier ":" @i)
    (format_expression ["{" "}"] @i) @_
    (comment) @c
    [(integer) (float)] @n
    [(true) (false) (none) KEYWORDS] @k
    (function_definition name: (identifier) @f)
    (class_definition name: (identifier) @f)
    (decorator ["@" (identifier) (attribute)] @a)
    (decorator (call function: (_) @a))
"""
"""The nodes of each class of `highlight.py`, and (`_`) those of none. A string that is a statement
of its own is a docstring."""
_ORDER = "sd_icnkfa"
"""The classes from the outside in: where two overlap, the later one wins."""


def python_runs(code: str) -> Iterator[tuple[str, str]]:
    """The code in runs, each with its class, perhaps an empty one."""
    data = code.encode()
    parser, query = _python()
    nodes_by_class = QueryCursor(query).captures(parser.parse(data).root_node)
    classes = bytearray(b"_") * len(data)
    edges = {0, len(data)}
    for css in _ORDER:
        for node in nodes_by_class.get(css, ()):
            start, end = node.byte_range
            classes[start:end] = css.encode() * (end - start)
            edges.update((start, end))
    for start, end in pairwise(sorted(edges)):
        yield chr(classes[start]).strip("_"), data[start:end].decode()


@functools.cache
def _python() -> tuple[Parser, Query]:
    language = Language(tree_sitter_python.language())
    keywords = " ".join(f'"{word}"' for word in _KEYWORDS.split())
    return Parser(language), Query(language, _QUERY.replace("KEYWORDS", keywords))


_PYTHON = ("python", "py", "python3", "py3")
_MAX_FOR_TREE_SITTER = 20_000
"""The most characters of Python that tree-sitter reads. For absurd texts, such as backslashes only,
its time grows with the square of the length, unlike that of Pygments: a second at this length."""
_PLAIN = ("", "text")
_WITHOUT_OUTER_SPACE = regex(r"\S(?:.*\S)?")


def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The lines of code as HTML, no element across the end of one; escaped text without a lexer."""
    text = visible(code)
    # Lexers drop a byte order mark at the start.
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    text, language = text.removeprefix(mark), language.lower()
    runs: Iterable[tuple[str, str]] = [("", text)]
    if language in _PYTHON and len(text) <= _MAX_FOR_TREE_SITTER:
        runs = python_runs(text)
    elif language not in _PLAIN:
        from coursebuild.core.pages.lexers import pygments_runs

        runs = pygments_runs(language, text) or runs
    groups = [["", mark]]
    for css, run in runs:  # neighbours of the same class, with the space between them on a line
        if css == groups[-1][0] or not run or (run.isspace() and "\n" not in run):
            groups[-1][1] += run
        else:
            groups.append([css, run])
    parts: list[str] = []
    for css, run in groups:
        html = escape(run, quote=False)
        if css:  # an element for each line, without the white space around it
            html = _WITHOUT_OUTER_SPACE.sub(rf'<span class="{css}">\g<0></span>', html)
        parts.append(html)
    return tuple(map(Markup, "".join(parts).split("\n")))
