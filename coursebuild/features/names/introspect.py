"""The child process that lists the names of MuJoCo and of MJCF.

Entry point: run as a file by `known_names`, in the environment of the scripts. It says `ready`;
then each line asks for the names, and the answer is a `known_names.EngineNames`.
"""

from __future__ import annotations

import inspect
import json
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

_TYPE = re.compile(r"->\s*(?:\w+(?:\.|::))*_?(\w+)")


def main() -> None:
    """Serve until the input closes."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what an import prints is no answer
    import mujoco

    print("ready", file=replies, flush=True)
    for _ in sys.stdin:
        # Python has not all of the functions, and none of the macros.
        headers = Path(mujoco.__file__).parent.glob("include/**/*.h")
        texts = (header.read_text("utf-8", "replace") for header in headers)
        names = {
            **_engine(mujoco),
            "schema": mujoco.mj_printSchema(False, False),
            "declared": sorted({name for t in texts for name in re.findall(r"\bmj[a-z]?_\w+", t)}),
        }
        print(json.dumps(names), file=replies, flush=True)


def _engine(mujoco: ModuleType) -> dict[str, Any]:
    """The functions, constants and enumerations of MuJoCo, and its classes with their fields."""
    try:
        from mujoco.introspect.enums import ENUMS
        from mujoco.introspect.functions import FUNCTIONS
        from mujoco.introspect.structs import STRUCTS
    except ImportError:  # an old MuJoCo describes itself in docstrings alone
        ENUMS = FUNCTIONS = STRUCTS = {}
    functions = {name: _describe(function) for name, function in FUNCTIONS.items()}
    enums = {name: list(enum.values) for name, enum in ENUMS.items()}
    constants: dict[str, str] = {}
    classes: dict[str, Any] = {}
    for module in (sys.modules.get("mujoco._structs", mujoco), mujoco):
        for name, value in vars(module).items():
            if inspect.isclass(value) and name not in enums:
                fields = _fields(STRUCTS.get(f"mj{name[2:]}"))
                classes[name.lstrip("_")] = dict(_members(value, fields))
            elif callable(value) and name.startswith("mj") and name not in enums:
                doc = (value.__doc__ or "").strip().split("\n\n")
                description = functions.get(name, {"doc": " ".join(doc[1:2])})
                functions[name] = {
                    **description,
                    "text": doc[0].split("\n")[0] or description.get("text", ""),
                }
            elif name.startswith("mj") and isinstance(value, int | float | str):
                constants[name] = repr(value)
    structs = {n: _fields(s) for n, s in STRUCTS.items() if f"Mj{n[2:]}" not in classes}
    return {
        "version": mujoco.__version__,
        "functions": functions,
        "enums": enums,
        "constants": constants,
        "classes": classes | structs,
    }


def _describe(declaration: Any) -> dict[str, Any]:
    extent = getattr(declaration, "array_extent", None) or ()
    return {"text": str(declaration), "doc": declaration.doc, "extent": list(map(str, extent))}


def _fields(struct: Any) -> dict[str, Any]:
    fields = () if struct is None else struct.fields
    return {field.name: _describe(field) for field in fields if hasattr(field, "name")}


def _members(cls: type, fields: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The members of a class; their types are said by what pybind11 writes into docstrings."""
    for name in dir(cls):
        if name.startswith("_"):
            continue
        value = inspect.getattr_static(cls, name)
        text = (getattr(getattr(value, "fget", value), "__doc__", None) or "").strip()
        types = _TYPE.findall(text)
        doc = " ".join(" ".join(text.split("\n\n")[1:2]).split())
        first = text.split("\n")[0] if callable(value) else ""
        description = fields.get(name, {"text": first, "doc": doc})
        yield name, {**description, "type": types[-1] if types else ""}


if __name__ == "__main__":
    main()
