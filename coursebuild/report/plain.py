"""Values as JSON has them.

Entry points: `json_text`, `plain`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Span


def json_text(value: object) -> str:
    """A value as JSON, ending in a newline."""
    return json.dumps(plain(value), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def plain(value: object, **names: str) -> Any:
    """A value as dictionaries, lists, texts and numbers; what is no finite number is `None`.

    A struct is an object of its fields, under other names where `names` has some. Its `span` are
    the path, the line and the columns, as fields of the object itself.
    """
    match value:
        case Diagnostic():
            return {
                "rule": value.rule,
                "severity": value.severity.value,
                **place_fields(value.span),
                "message": value.message,
                "label": value.label,
                "help": value.help,
                "notes": plain(value.notes),
            }
        case Struct():
            fields: dict[str, Any] = {}
            for name in value.__struct_fields__:
                field = getattr(value, name)
                fields |= (
                    place_fields(field) if name == "span" else {names.get(name, name): plain(field)}
                )
            return fields
        case Mapping():
            return {key: plain(one) for key, one in value.items()}
        case list() | tuple():
            return [plain(one) for one in value]
        case Enum():
            return value.value
        case float() if not math.isfinite(value):
            return None
        case _:
            return value


def place_fields(span: Span | None) -> dict[str, Any]:
    """Where something stands; all `None` where that is not known."""
    if span is None:
        return dict.fromkeys(("path", "line", "column", "end_line", "end_column"))
    return {
        "path": span.path,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
    }
