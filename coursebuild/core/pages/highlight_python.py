"""Python code as runs of text with the same class.

Entry point: `python_runs(code)`. tree-sitter also reads code that does not parse, such as a
fragment or a mistake that a lesson makes on purpose.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from itertools import pairwise

import tree_sitter_python
from tree_sitter import Language, Parser, Query, QueryCursor

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
    nodes_by_class = QueryCursor(_query()).captures(_parser().parse(data).root_node)
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
def _language() -> Language:
    return Language(tree_sitter_python.language())


@functools.cache
def _parser() -> Parser:
    return Parser(_language())


@functools.cache
def _query() -> Query:
    keywords = " ".join(f'"{word}"' for word in _KEYWORDS.split())
    return Query(_language(), _QUERY.replace("KEYWORDS", keywords))
