"""JSON Schemas of what an author writes in JSON and TOML, for editors.

Entry points: `json_schema(name)`; `schema_roots`, what there are some of.

They are made from the declarations that the decoder checks against, so that an editor and a build
say the same; what only checks know (an answer that is one of the options) is not in them.
"""

from __future__ import annotations

import copy
from typing import Any

import msgspec
from msgspec import Struct

from coursebuild.core.registry import features
from coursebuild.core.syntax.course_schema import CourseFile
from coursebuild.core.syntax.scenarios import ModelFile

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_ROOTS: dict[str, tuple[type[Struct], str]] = {
    "course": (CourseFile, "The course map, content/course.toml"),
    "model": (ModelFile, "The file beside a model, models/NAME.toml"),
}


def schema_roots() -> dict[str, tuple[type[Struct], str]]:
    """What there are schemas of, by name: the declared type, and its title."""
    return _ROOTS | {name: root for each in features() for name, root in each.schemas.items()}


def json_schema(name: str) -> bytes:
    """The JSON Schema (draft 2020-12), indented, keys in a fixed order, with a final newline."""
    root, title = schema_roots()[name]
    made = copy.deepcopy(msgspec.json.schema(root))
    definitions: dict[str, Any] = made["$defs"]
    if name == "course":
        definitions["Silence"]["required"].append("reason")
    for refine in (feature.refine_schema for feature in features()):
        if refine is not None:
            refine(definitions)
    schema = {
        "$schema": DIALECT,
        "title": title,
        "$ref": made["$ref"],
        "$defs": dict(sorted(definitions.items())),
    }
    return msgspec.json.format(msgspec.json.encode(schema), indent=2) + b"\n"
