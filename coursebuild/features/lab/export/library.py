"""What of `helpers` an exported script brings along, and what it imports.

Entry points: `LIBRARY`, the definitions by name; `helpers`, those that code needs; `imports`;
`RESERVED`, names that are taken.
"""

from __future__ import annotations

import ast
import keyword
from collections.abc import Iterator
from pathlib import Path

_SOURCE = Path(__file__).with_name("helpers.py").read_text(encoding="utf-8")


def _definitions() -> Iterator[tuple[str, str]]:
    for node in ast.parse(_SOURCE).body:
        match node:
            case ast.FunctionDef() | ast.ClassDef():
                yield node.name, ast.get_source_segment(_SOURCE, node) or ""
            case ast.Assign(targets=[ast.Name(id=name)]):
                yield name, ast.get_source_segment(_SOURCE, node) or ""
            case _:
                pass


LIBRARY = dict(_definitions())
"""What a script can bring along, by name, in the order in which it stands there."""

RESERVED = frozenset(
    """
        model data ctx lib math np mujoco sim abs float int str any range max min len print format
        Ctx load start reset step simulate readouts report main control random struct
        model_path Iterable NamedTuple dataclass field Context Decimal ROUND_HALF_UP
    """.split()
).union(LIBRARY, keyword.kwlist, keyword.softkwlist)
"""Names that nothing else in a script may have."""

_IMPORTS = {
    "collections.abc": ("Iterable",),
    "dataclasses": ("dataclass", "field"),
    "decimal": ("ROUND_HALF_UP", "Context", "Decimal"),
    "typing": ("NamedTuple",),
}
"""What a script takes from modules of the standard library, by module."""


def names_in(*sections: str) -> set[str]:
    """The names that code uses, and that the section of it where it does so does not define."""
    found: set[str] = set()
    for section in sections:
        names = [node for node in ast.walk(ast.parse(section)) if isinstance(node, ast.Name)]
        own = {name.id for name in names if isinstance(name.ctx, ast.Store)}
        found |= {name.id for name in names} - own
    return found


def helpers(*sections: str) -> list[str]:
    """Names of the helpers that code uses, and of those that they use, in order."""
    wanted, new = set[str](), names_in(*sections) & LIBRARY.keys()
    while new:
        wanted |= new
        new = names_in(*(LIBRARY[name] for name in new)) & LIBRARY.keys() - wanted
    return [name for name in LIBRARY if name in wanted]


def imports(*sections: str) -> list[str]:
    """The import statements that code needs, in their usual order, with lines between groups."""
    used = names_in(*sections)
    standard = [f"import {module}" for module in ("math", "struct") if module in used]
    for module, names in _IMPORTS.items():
        if taken := [name for name in names if name in used]:
            standard.append(f"from {module} import {', '.join(taken)}")
    engine = ["import mujoco", *(["import numpy as np"] if "np" in used else [])]
    own = ["from mjcourse import model_path"] if "model_path" in used else []
    groups = (standard, engine, own)
    return "\n\n".join("\n".join(group) for group in groups if group).split("\n")
