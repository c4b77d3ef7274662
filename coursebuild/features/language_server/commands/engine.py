"""Fields of `data` and `model`, and functions of the engine, as MuJoCo's package describes them.

Entry points: `members`, the names that can follow a dot; `describe_name`; `describe_shape`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from coursebuild.core.model.results import ModelFacts
from coursebuild.core.pages.marks import escape_text, fence
from coursebuild.core.text.source import Span

_ASSIGNMENT = re.compile(r"(\w+)\s*=\s*mujoco\.Mj(Data|Model)\b")
_ROOTS = {"data": "mjData", "model": "mjModel"}
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")


def members(path: tuple[str, ...], code: str) -> Mapping[str, Any]:
    """Return the declarations of what can follow `data.`, `model.opt.` or `mujoco.`, by name.

    The type of a variable follows from its assignment in the code, or else from its name.
    """
    import mujoco
    from mujoco.introspect.functions import FUNCTIONS
    from mujoco.introspect.structs import STRUCTS

    if path == ("mujoco",):
        return {n: function for n, function in FUNCTIONS.items() if hasattr(mujoco, n)}
    roots = _ROOTS | {name: f"mj{kind}" for name, kind in _ASSIGNMENT.findall(code)}
    struct: Any = STRUCTS.get(roots.get(path[0], ""))
    for name in path[1:]:
        inner = getattr(_fields(struct).get(name), "type", None)
        struct = inner if hasattr(inner, "fields") else STRUCTS.get(getattr(inner, "name", ""))
    # Some fields exist only in the C library, and not in the class of the Python package.
    python_class = getattr(mujoco, f"Mj{getattr(struct, 'name', '')[2:]}", None)
    fields = _fields(struct).items()
    return {n: field for n, field in fields if python_class is None or hasattr(python_class, n)}


def _fields(struct: Any) -> Mapping[str, Any]:
    fields = () if struct is None else struct.fields
    return {field.name: field for field in fields if hasattr(field, "name")}


def describe_name(
    code: Span, offset: int, facts: ModelFacts | None = None
) -> tuple[Span, str] | None:
    """Return the dotted name that ends at an offset of some code, and its description.

    `facts` are those of the code's model: they turn symbolic sizes into numbers.
    """
    names = _NAME.finditer(code.source.text, code.start, code.end)
    match = next((match for match in names if match.start() <= offset < match.end()), None)
    if match is None:
        return None
    end = code.source.text.find(".", offset, match.end())
    span = code.source.span(match.start(), end if end >= 0 else match.end())
    *path, name = span.text.split(".")
    declaration = members(tuple(path), code.text).get(name) if path else None
    if declaration is None:
        return None
    text = f"{fence('c', str(declaration))}\n{escape_text(declaration.doc)}"
    extent = getattr(declaration, "array_extent", None)
    return span, f"{text}\n\n{describe_shape(extent, facts)}" if extent else text


def describe_shape(extent: Iterable[str | int], facts: ModelFacts | None) -> str:
    """Say the shape of an array, with numbers for the sizes that are known."""
    sizes: dict[str | int, int] = {}
    if facts is not None:
        sizes = {"nq": facts.nq, "nv": facts.nv, "nu": facts.nu, "nbody": facts.bodies + 1}
        sizes |= {"ngeom": facts.geoms, "njnt": facts.joints, "nkey": len(facts.keyframes)}
    names, numbers = tuple(extent), tuple(sizes.get(size, size) for size in extent)
    suffix = f", here `{numbers}`" if numbers != names else ""
    return f"shape `{names}`{suffix}".replace("'", "")
