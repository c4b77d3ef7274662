"""The JSON Schemas of what this program writes and reads.

That of reports is made of their types; what stands below a field there is its description. That of
scenarios is a file, since other programs write it too: `schemas/scenarios.schema.json`.
"""

from __future__ import annotations

import ast
import inspect
import json
from importlib.resources import files
from itertools import pairwise
from typing import Any

import msgspec

from mjbench.reports.records import BENCH, DIET, ENGINES, STABILITY, VERSION, ReportKind

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_text(name: str) -> str:
    """The schema of `reports` or of `scenarios`, as JSON."""
    if name == "scenarios":
        return (files("mjbench") / "schemas" / "scenarios.schema.json").read_text("utf-8")
    return json.dumps(_report_schema(), indent=1, ensure_ascii=False) + "\n"


def _report_schema() -> dict[str, Any]:
    """A file holds a report of one kind."""
    kinds: tuple[ReportKind[Any], ...] = (BENCH, ENGINES, DIET, STABILITY)
    types = [kind.type for kind in kinds]
    reports, definitions = msgspec.json.schema_components(types, ref_template="#/$defs/{name}")
    descriptions = _field_descriptions()
    for name, definition in definitions.items():
        for field, schema in definition.get("properties", {}).items():
            if text := descriptions.get((name, field)):
                schema["description"] = text
    choices = []
    for kind, report in zip(kinds, reports, strict=True):
        properties: dict[str, Any] = {
            "holds": {"const": f"mjbench {kind.name}"},
            "version": {"const": VERSION},
            kind.field: report,
        }
        choices.append(
            {
                "type": "object",
                "properties": properties,
                "required": [*properties],
                "additionalProperties": False,
            }
        )
    return {
        "$schema": _DIALECT,
        "title": f"Reports of mjbench, version {VERSION}",
        "oneOf": choices,
        "$defs": dict(sorted(definitions.items())),
    }


def _field_descriptions() -> dict[tuple[str, str], str]:
    """What stands below the fields of all types of reports, by class and field."""
    from mjbench import machine, reports
    from mjbench.reports import (
        charts,
        diet_report,
        model_report,
        scene_report,
    )

    modules = (
        reports,
        machine,
        charts,
        scene_report,
        model_report,
        diet_report,
    )
    fields: dict[str, dict[str, str]] = {}
    for module in modules:
        for node in ast.parse(inspect.getsource(module)).body:
            if isinstance(node, ast.ClassDef):
                bases = (ast.unparse(base).rpartition(".")[2] for base in node.bases)
                inherited = {k: v for base in bases for k, v in fields.get(base, {}).items()}
                fields[node.name] = inherited | _texts_below(node)
    return {(name, field): text for name, texts in fields.items() for field, text in texts.items()}


def _texts_below(node: ast.ClassDef) -> dict[str, str]:
    return {
        field.target.id: " ".join(text.value.value.split()).replace("`None`", "`null`")
        for field, text in pairwise(node.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
        if isinstance(text.value.value, str)
    }
