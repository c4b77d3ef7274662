"""The numbers that a module is written with, and those that nothing true depends on."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import pairwise, starmap

from msgspec import Struct

WHOLE = 1000
"""More lines than a module has."""
RULES = {
    "bound of a run": r"\w*bound|room|\w*_BOUND",
    "time that is tried": r"timesteps|search|span|\w*_SPAN|_STEPS?|steps|timestep|duration",
    "allowed difference": r"precision|_PRECISION",
    "end of an iteration": r"tolerance|xtol|iterations",
    "choice of runs": r"_MEMBERS|_RADIUS|_PHASES|_LENGTHS|_PARTING_ERROR|_SETTLING",
    "statistics of chaos": r"_ensemble|horizons|exponents",
    "number of a case": r"case",
}
"""Reasons by the name of a keyword, a constant, an attribute or a function."""


class Number(Struct, frozen=True):
    """A number in the text of a module."""

    file: str
    line: int
    node: int
    """Its node in a walk of the tree."""
    reason: str
    lines: range
    """Of its statement; of the module where it stands in no function."""
    span: tuple[int, int] | None = None
    """Where it is in a string."""
    text: str = ""


def numbers_of(file: str, tree: ast.Module) -> Iterator[Number]:
    """All but 0, also in MJCF."""
    nodes = list(ast.walk(tree))
    parents = {child: node for node in nodes for child in ast.iter_child_nodes(node)}
    for index, node in enumerate(nodes):
        if not isinstance(node, ast.Constant):
            continue
        chain: list[ast.AST] = [node]
        while chain[-1] in parents:
            chain.append(parents[chain[-1]])
        statement = next(part for part in chain if isinstance(part, ast.stmt))
        lines = range(statement.lineno, (statement.end_lineno or 0) + 1)
        if not any(isinstance(part, ast.FunctionDef | ast.Lambda) for part in chain):
            lines = range(WHOLE)
        reason = next(filter(None, starmap(excuse, pairwise(chain))), "")
        if isinstance(node.value, str) and not isinstance(statement, ast.Expr):
            whole = chain[1] if isinstance(chain[1], ast.JoinedStr) else node
            if '="' not in ast.unparse(whole) and not re.fullmatch(r"[-+.\de ]+", node.value):
                continue
            for match in re.finditer(r"(?<![\w.])-?\d[\d.]*(e[-+]?\d+)?(?![\w.])", node.value):
                name = re.search(r'(\w+)="[^"]*$', node.value[: match.start()])
                cause = reason or rule(name[1] if name else "")
                if float(match[0]):
                    yield Number(file, node.lineno, index, cause, lines, match.span(), match[0])
        elif type(node.value) in (int, float) and node.value:
            yield Number(file, node.lineno, index, reason, lines, None, repr(node.value))


def rule(name: str) -> str:
    return next((reason for reason, names in RULES.items() if re.fullmatch(names, name)), "")


def excuse(node: ast.AST, parent: ast.AST) -> str:
    """The rule for a node as a part of its parent; empty without one."""
    match parent:
        case ast.keyword(arg=str(name)) | ast.AnnAssign(target=ast.Name(id=name)):
            return rule(name)
        case ast.FunctionDef(name=name):
            return rule(name)
        case ast.Assign(targets=[target]):
            reasons = {rule(part.id) for part in ast.walk(target) if isinstance(part, ast.Name)}
            return min(reasons, default="")
        case ast.Call(func=ast.Name(id="Scenario")) if node in parent.args[:2]:
            return rule("duration")
    return ""
