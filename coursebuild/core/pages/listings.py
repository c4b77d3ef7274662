"""Code as pages show it: as HTML, and which parts of it a reader sees at first.

1. tree-sitter reads Python, the language of most code, eight times as fast as Pygments, which reads
   the other languages. It also reads code that does not parse, such as a fragment or a mistake that
   a lesson makes on purpose. The many kinds of tokens are mapped to few classes.
2. A fold begins and ends between top-level statements. The head (docstring, imports, constants) is
   folded if it is long: the page around the script has said what it is for. The rest is shown up to
   `SHOWN_LINES` lines and then folded, except for the `__main__` guard at the end, which says what
   the script does.
"""

from __future__ import annotations

import ast
import functools
import re
import warnings
from collections.abc import Iterable, Iterator
from html import escape
from itertools import pairwise

import tree_sitter_python
from markupsafe import Markup
from msgspec import Struct
from pygments.lexer import Lexer
from pygments.lexers import find_lexer_class_by_name
from pygments.token import Comment, Keyword, Literal, Name, Operator, String, Token, _TokenType
from pygments.util import ClassNotFound
from tree_sitter import Language, Parser, Query, QueryCursor

from coursebuild.core.text.characters import visible

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


_CLASSES: tuple[tuple[_TokenType, str], ...] = (
    (Comment, "c"),
    (String.Doc, "d"),
    (String.Interpol, "i"),
    (String, "s"),
    (Literal.Number, "n"),
    (Keyword, "k"),
    (Operator.Word, "k"),
    (Name.Function, "f"),
    (Name.Class, "f"),
    (Name.Decorator, "a"),
    (Name.Attribute, "a"),
    (Name.Tag, "t"),
    (Token.Generic.Prompt, "p"),
    (Token.Generic.Deleted, "x"),
    (Token.Generic.Inserted, "y"),
)
"""Kinds of tokens and their classes, the special before the general."""
_PYTHON = ("python", "py", "python3", "py3")
_MAX_FOR_TREE_SITTER = 20_000
"""The most characters of Python that tree-sitter reads. For absurd texts, such as backslashes only,
its time grows with the square of the length, unlike that of Pygments: a second at this length."""
_ALIASES = {"mjcf": "xml", "urdf": "xml"}
_WITHOUT_OUTER_SPACE = re.compile(r"\S(?:.*\S)?")


def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The lines of code as HTML, no element across the end of one; escaped text without a lexer."""
    text = visible(code)
    # Lexers drop a byte order mark at the start.
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    text, language = text.removeprefix(mark), language.lower()
    runs: Iterable[tuple[str, str]] = [("", text)]
    if language in _PYTHON and len(text) <= _MAX_FOR_TREE_SITTER:
        runs = python_runs(text)
    elif (lexer := _lexer(_ALIASES.get(language, language))) is not None:
        for end in ("", "\n"):  # lexers of sessions need a line end
            tokens = [(_class_of(token), part) for token, part in lexer.get_tokens(text + end)]
            if "".join(part for _, part in tokens) == text + end:  # else nothing is marked
                if end:
                    css, part = tokens.pop()
                    tokens.append((css, part.removesuffix(end)))
                runs = tokens
                break
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
            element = f'<span class="{css}">'
            html = _WITHOUT_OUTER_SPACE.sub(rf"{element}\g<0></span>", html)
        parts.append(html)
    return tuple(map(Markup, "".join(parts).split("\n")))


@functools.cache
def _lexer(language: str) -> Lexer | None:
    try:
        return find_lexer_class_by_name(language)(stripnl=False, ensurenl=False)
    except ClassNotFound:
        return None


@functools.cache
def _class_of(token: _TokenType) -> str:
    return next((css for kind, css in _CLASSES if token in kind), "")


LONG = 48
"""Lines; a script up to this length is not folded."""
HEAD = 8
"""Lines; a head shorter than this is not worth folding."""
SHOWN_LINES = 44
"""About how many lines of the rest are shown."""
TAIL = 12
"""Lines; a `__main__` guard up to this length is not folded, and no fold is shorter than this."""

_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


class Part(Struct, frozen=True):
    """Whole lines of a script, from `first` to `last` (from 1, both included)."""

    first: int
    last: int
    folded: bool
    docstring: bool = False
    imports: bool = False
    names: tuple[str, ...] = ()


def fold(code: str) -> tuple[Part, ...]:
    """The parts of a script; a short one, or one that does not parse, is a single part."""
    return _analyse(code)[0]


def find_imports(code: str) -> frozenset[str]:
    """The top-level modules that a Python text imports; none if it does not parse."""
    return _analyse(code.rstrip("\n"))[1]  # so that drawing it finds it in the cache


@functools.lru_cache(maxsize=1024)
def _analyse(code: str) -> tuple[tuple[Part, ...], frozenset[str]]:
    """The parts and the modules; both are needed, as a lesson is read and as it is drawn."""
    nodes = python_nodes(code)
    lines = code.removesuffix("\n").split("\n")
    parts: tuple[Part, ...] = (Part(1, len(lines), folded=False),)
    if len(lines) > LONG and nodes:
        parts = _fold_long(nodes[0].body, lines)  # type: ignore[attr-defined]  # of a module
    modules: set[str] = set()
    for node in nodes:
        if type(node) is ast.Import:
            modules.update(alias.name.partition(".")[0] for alias in node.names)
        elif type(node) is ast.ImportFrom and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return parts, frozenset(modules)


@functools.lru_cache(maxsize=8)
def python_nodes(code: str) -> tuple[ast.AST, ...]:
    """All nodes of a Python text, the module first, level by level; none if it does not parse.

    Parts that hold nothing, such as `ast.Load`, are left out.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            nodes: list[ast.AST] = [ast.parse(code)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ()
    for node in nodes:  # grows in the loop; as `ast.walk`, in half the time
        for name in node._fields:
            part = getattr(node, name, None)
            if type(part) is list:
                nodes += [item for item in part if isinstance(item, ast.AST)]
            elif isinstance(part, ast.AST) and part._fields:
                nodes.append(part)
    return tuple(nodes)


def _fold_long(body: list[ast.stmt], lines: list[str]) -> tuple[Part, ...]:
    starts: list[int] = []
    for statement in body:
        decorators = statement.decorator_list if isinstance(statement, _DEFINITIONS) else ()
        starts.append(min([statement.lineno, *(node.lineno for node in decorators)]))
    if not body or len(set(starts)) != len(starts):
        return (Part(1, len(lines), folded=False),)
    cuts = [*starts, len(lines) + 1]
    for number in range(len(starts)):  # comments above a statement belong to it
        while cuts[number] > 1 and lines[cuts[number] - 2].startswith("#"):
            cuts[number] -= 1
    # The head has the docstring, imports, and constants before a definition.
    head = int(_is_docstring(body[0]))
    while head < len(body) and isinstance(body[head], ast.Import | ast.ImportFrom):
        head += 1
    first = head
    while first < len(body) and isinstance(body[first], ast.Assign | ast.AnnAssign):
        first += 1
    if first < len(body) and isinstance(body[first], _DEFINITIONS):
        head = first
    if head == len(body) or cuts[head] - 1 < HEAD:
        return _fold_rest(body, [1, *cuts[1:]], lines)
    return (
        _folded_part(1, cuts[head] - 1, body[:head]),
        *_fold_rest(body[head:], cuts[head:], lines),
    )


def _fold_rest(body: list[ast.stmt], cuts: list[int], lines: list[str]) -> tuple[Part, ...]:
    """The parts after the head; statement `i` has the lines from `cuts[i]` to before `cuts[i + 1]`.

    Blank lines at the border of a fold belong to the fold.
    """
    first, total = cuts[0], len(lines)
    shown_count = 1
    while shown_count < len(body) and cuts[shown_count + 1] - first <= SHOWN_LINES:
        shown_count += 1
    last = body[-1]
    is_guard = isinstance(last, ast.If) and "__name__" in ast.dump(last.test)
    has_guard = shown_count < len(body) and is_guard and total - cuts[-2] < TAIL
    stop = len(body) - 1 if has_guard else len(body)
    end = cuts[shown_count] - 1
    while end > first and not lines[end - 1].strip():
        end -= 1
    if cuts[stop] - 1 - end < TAIL:
        return (Part(first, total, folded=False),)
    guard = (Part(cuts[stop], total, folded=False),) if has_guard else ()
    return (
        Part(first, end, folded=False),
        _folded_part(end + 1, cuts[stop] - 1, body[shown_count:stop]),
        *guard,
    )


def _folded_part(first: int, last: int, body: list[ast.stmt]) -> Part:
    docstring = _is_docstring(body[0]) if first == 1 else False
    imports = any(isinstance(statement, ast.Import | ast.ImportFrom) for statement in body)
    names: list[str] = []
    for statement in body:
        if isinstance(statement, _DEFINITIONS):
            names.append(statement.name)
        elif isinstance(statement, ast.Assign):
            names += [target.id for target in statement.targets if isinstance(target, ast.Name)]
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            names.append(statement.target.id)
    return Part(first, last, True, docstring, imports, tuple(names))


def _is_docstring(statement: ast.stmt) -> bool:
    if not isinstance(statement, ast.Expr) or not isinstance(statement.value, ast.Constant):
        return False
    return isinstance(statement.value.value, str)
