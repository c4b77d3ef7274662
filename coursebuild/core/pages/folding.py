"""Folding long scripts: which parts a reader sees at first.

Entry points: `fold(code)`; `find_imports(code)`, the modules that it imports.

1. A fold begins and ends between top-level statements.
2. The head (docstring, imports, constants) is folded if it is long: the page around the script has
   said what it is for.
3. The rest is shown up to `SHOWN_LINES` lines and then folded, except for the `__main__` guard at
   the end, which says what the script does.
"""

from __future__ import annotations

import ast
import functools
import warnings

from msgspec import Struct

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
    """Whether it holds the script's docstring."""
    imports: bool = False
    """Whether it holds imports."""
    names: tuple[str, ...] = ()
    """Names that it defines."""


def fold(code: str) -> tuple[Part, ...]:
    """The parts of a script; a short one, or one that does not parse, is a single part."""
    return _analyse(code)[0]


def find_imports(code: str) -> frozenset[str]:
    """The top-level modules that a Python text imports; none if it does not parse."""
    return _analyse(code.rstrip("\n"))[1]  # so that drawing it finds it in the cache


@functools.lru_cache(maxsize=1024)
def _analyse(code: str) -> tuple[tuple[Part, ...], frozenset[str]]:
    """The parts and the modules; both are needed, as a lesson is read and as it is drawn."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            body = ast.parse(code).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        body = []
    lines = code.removesuffix("\n").split("\n")
    parts = _fold_long(body, lines) if len(lines) > LONG else (Part(1, len(lines), folded=False),)
    modules: set[str] = set()
    stack: list[ast.AST] = [*body]
    while stack:
        node = stack.pop()
        if isinstance(node, ast.Import):
            modules.update(alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.module and not node.level:
                modules.add(node.module.partition(".")[0])
        else:
            for name in ("body", "orelse", "finalbody", "handlers", "cases"):
                stack += getattr(node, name, None) or ()
    return parts, frozenset(modules)


def _fold_long(body: list[ast.stmt], lines: list[str]) -> tuple[Part, ...]:
    """The parts of a long script."""
    unfolded = (Part(1, len(lines), folded=False),)
    starts = [_start(statement) for statement in body]
    if not body or len(set(starts)) != len(starts):
        return unfolded
    cuts = [*(_with_comments(lines, start) for start in starts), len(lines) + 1]
    head = _head_length(body)
    if head == len(body) or cuts[head] - 1 < HEAD:
        return _fold_rest(body, [1, *cuts[1:]], lines)
    return (
        _folded_part(1, cuts[head] - 1, body[:head]),
        *_fold_rest(body[head:], cuts[head:], lines),
    )


def _fold_rest(body: list[ast.stmt], cuts: list[int], lines: list[str]) -> tuple[Part, ...]:
    """The parts after the head: a visible one, perhaps a folded one, perhaps the guard.

    Statement `i` has the lines from `cuts[i]` to before `cuts[i + 1]`. Blank lines at the border of
    a fold belong to the fold.
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


def _start(statement: ast.stmt) -> int:
    """The first line of a statement, its decorators included."""
    if isinstance(statement, _DEFINITIONS):
        return min([statement.lineno, *(d.lineno for d in statement.decorator_list)])
    return statement.lineno


def _with_comments(lines: list[str], start: int) -> int:
    """The line where the comments above a statement begin."""
    while start > 1 and lines[start - 2].startswith("#"):
        start -= 1
    return start


def _head_length(body: list[ast.stmt]) -> int:
    """How many statements the head has: docstring, imports, constants.

    Assignments are constants if only assignments come before the first definition.
    """
    count = int(_is_docstring(body[0]))
    while count < len(body) and isinstance(body[count], ast.Import | ast.ImportFrom):
        count += 1
    first = count
    while first < len(body) and isinstance(body[first], ast.Assign | ast.AnnAssign):
        first += 1
    defines = first < len(body) and isinstance(body[first], _DEFINITIONS)
    return first if defines else count


def _is_docstring(statement: ast.stmt) -> bool:
    if not isinstance(statement, ast.Expr) or not isinstance(statement.value, ast.Constant):
        return False
    return isinstance(statement.value.value, str)
