"""JSON Schemas of what an author writes in JSON and TOML, made from what the decoder uses."""

from __future__ import annotations

import copy
from typing import Any

import msgspec
from msgspec import Struct

from coursebuild.core.registry import features
from coursebuild.core.syntax.course_schema import CourseFile
from coursebuild.core.syntax.declarations import ModelFile

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_ROOTS: dict[str, tuple[type[Struct], str]] = {
    "course": (CourseFile, "The course map, content/course.toml"),
    "model": (ModelFile, "The file beside a model, models/NAME.toml"),
}


def schema_roots() -> dict[str, tuple[type[Struct], str]]:
    """The declared type and the title of each schema, by name."""
    return _ROOTS | {name: root for feature in features() for name, root in feature.schemas.items()}


def json_schema(name: str) -> bytes:
    """The JSON Schema (draft 2020-12), indented, keys in a fixed order, with a final newline."""
    root, title = schema_roots()[name]
    schema = copy.deepcopy(msgspec.json.schema(root))
    definitions: dict[str, Any] = schema["$defs"]
    if name == "course":
        definitions["Silence"]["required"].append("reason")
    for refine in (feature.refine_schema for feature in features()):
        if refine is not None:
            refine(definitions)
    schema = {
        "$schema": DIALECT,
        "title": title,
        "$ref": schema["$ref"],
        "$defs": dict(sorted(definitions.items())),
    }
    return msgspec.json.format(msgspec.json.encode(schema), indent=2) + b"\n"
