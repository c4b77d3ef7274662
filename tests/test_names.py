"""Names of functions and variables say what they hold.

`found`, `one` or `told` say nothing to a stranger; `diagnostics`, `page` or `messages` do. So none
is a participle, a pronoun, a preposition or a question word alone. A participle before a noun is
fine (`drawn_pages`), and so is a field of a record (`cached`), whose class says what it is of.
"""

from __future__ import annotations

import ast
import symtable
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = "coursebuild mjbench mjcourse plugins tests benchmarks docs site".split()
PARTICIPLES = (
    "added allowed applied asked begun built checked chosen claimed closed compiled copied counted "
    "cut declared decoded defined described drawn edited encoded ended escaped failed finished "
    "found framed given gone grouped heard held joined kept known linked listed loaded made marked "
    "meant measured merged moved named needed noted numbered opened paired parsed passed placed "
    "published quoted raised ran reached removed said saved seen settled shown skipped "
    "started stated stopped stored taken told tried turned updated used waiting wanted written"
)
FUNCTION_WORDS = (
    "one ones other others own same this that these those it its them they there here each every "
    "both either neither more nothing something anything everything "
    "what where when why how who which "
    "about across against ahead along around behind beside between beyond into over under "
    "within without wrong"
)
RIDDLES = frozenset(f"{PARTICIPLES} {FUNCTION_WORDS}".split())


def identifiers(table: symtable.SymbolTable) -> Iterator[str]:
    """All that a module names, found in a fifth of the time that its tree takes."""
    yield table.get_name()
    yield from table.get_identifiers()
    for inner in table.get_children():
        yield from identifiers(inner)


def has_riddle(text: str) -> bool:
    names = identifiers(symtable.symtable(text, "module", "exec"))
    return any(name.strip("_") in RIDDLES for name in names)


def bound_names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """The names that a module gives to functions, parameters and variables, with their lines."""
    nodes = list(ast.walk(tree))
    fields = {s for node in nodes if isinstance(node, ast.ClassDef) for s in node.body}
    for node in nodes:
        match node:
            case ast.AnnAssign(target=ast.Name(id=name)) if node not in fields:
                yield name, node.lineno
            case ast.FunctionDef(name=name) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Assign() | ast.For() | ast.comprehension() | ast.NamedExpr() | ast.withitem():
                yield from assigned_names(node)
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)):
                yield name, node.lineno


def assigned_names(node: ast.AST) -> Iterator[tuple[str, int]]:
    """The variables to which a statement or expression assigns, but not those inside it."""
    for field in ("targets", "target", "optional_vars"):
        targets = getattr(node, field, None) or ()
        for target in targets if isinstance(targets, list) else [targets]:
            for name in ast.walk(target) if isinstance(target, ast.AST) else ():
                if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store):
                    yield name.id, name.lineno


def test_names_are_nouns_and_verbs() -> None:
    riddles = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for folder in FOLDERS
        for path in sorted((ROOT / folder).rglob("*.py"))
        if "node_modules" not in path.parts and "dist" not in path.parts
        if has_riddle(text := path.read_text(encoding="utf-8"))
        for name, line in bound_names(ast.parse(text))
        if name.strip("_") in RIDDLES
    ]
    assert not riddles, "\n".join(riddles)
