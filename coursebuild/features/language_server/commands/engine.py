"""Fields of `data` and `model`, and functions of the engine, as MuJoCo's package describes them.

Entry points: `members`, what stands behind a dot; `described_name`, what is said of a name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from coursebuild.core.model.results import ModelFacts
from coursebuild.core.text.source import Span

_MADE = re.compile(r"(\w+)\s*=\s*mujoco\.Mj(Data|Model)\b")
_ROOTS = {"data": "mjData", "model": "mjModel"}
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")


def members(path: tuple[str, ...], code: str) -> Mapping[str, Any]:
    """The declarations behind `data.`, `model.opt.` or `mujoco.` in some code, by name.

    A variable is of the type that the code makes it of, or that its name says.
    """
    import mujoco
    from mujoco.introspect.functions import FUNCTIONS
    from mujoco.introspect.structs import STRUCTS

    if path == ("mujoco",):
        return {name: one for name, one in FUNCTIONS.items() if hasattr(mujoco, name)}
    roots = _ROOTS | {name: f"mj{kind}" for name, kind in _MADE.findall(code)}
    declared: Any = STRUCTS.get(roots.get(path[0], ""))
    for name in path[1:]:
        inner = getattr(_fields(declared).get(name), "type", None)
        declared = inner if hasattr(inner, "fields") else STRUCTS.get(getattr(inner, "name", ""))
    # Some are of the library in C only.
    known = getattr(mujoco, f"Mj{getattr(declared, 'name', '')[2:]}", None)
    fields = _fields(declared).items()
    return {name: one for name, one in fields if known is None or hasattr(known, name)}


def _fields(declared: Any) -> Mapping[str, Any]:
    fields = () if declared is None else declared.fields
    return {field.name: field for field in fields if hasattr(field, "name")}


def described_name(
    code: Span, offset: int, facts: ModelFacts | None = None
) -> tuple[Span, str] | None:
    """The name with dots at an offset of some code, up to there, and what the engine says of it.

    `facts` are those of the model at hand, whose sizes become numbers.
    """
    names = _NAME.finditer(code.source.text, code.start, code.end)
    found = next((one for one in names if one.start() <= offset < one.end()), None)
    if found is None:
        return None
    end = code.source.text.find(".", offset, found.end())
    span = code.source.span(found.start(), end if end >= 0 else found.end())
    *path, name = span.text.split(".")
    declared = members(tuple(path), code.text).get(name) if path else None
    if declared is None:
        return None
    said = f"```c\n{declared}\n```\n{declared.doc}"
    extent = getattr(declared, "array_extent", None)
    return span, f"{said}\n\n{_shape(extent, facts)}" if extent else said


def _shape(extent: Iterable[str | int], facts: ModelFacts | None) -> str:
    sizes: dict[str | int, int] = {}
    if facts is not None:
        sizes = {"nq": facts.nq, "nv": facts.nv, "nu": facts.nu, "nbody": facts.bodies + 1}
        sizes |= {"ngeom": facts.geoms, "njnt": facts.joints, "nkey": len(facts.keyframes)}
    names, known = tuple(extent), tuple(sizes.get(one, one) for one in extent)
    here = f", here `{known}`" if known != names else ""
    return f"shape `{names}`{here}".replace("'", "")
