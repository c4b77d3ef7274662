"""The published schemas are those of the files that are written and read."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from msgspec.structs import replace

from mjbench.declarations import (
    BenchTable,
    DeclarationError,
    DeclarationFile,
    KeepTable,
    ScenarioTable,
    SweepTable,
    parse_declarations,
)
from mjbench.reports.records import BENCH, STABILITY
from mjbench.schemas import schema_text
from samples.cases import case
from samples.reports import awkward, scene, swing


def schema(name: str) -> dict[str, Any]:
    return json.loads(schema_text(name))


def test_reports_are_as_their_schema_says() -> None:
    validator = Draft202012Validator(schema("reports"))
    validator.check_schema(validator.schema)
    for data in (
        BENCH.encode(scene(swing(), replace(awkward(), name="awkward"))),
        STABILITY.encode((case(),)),
    ):
        validator.validate(json.loads(data))
    value = json.loads(BENCH.encode(scene()))
    for change in ({"version": 2}, {"scene": {}}, {"holds": "mjbench diet"}, {"more": 1}):
        with pytest.raises(ValidationError):
            validator.validate(value | change)


def test_fields_of_reports_are_described() -> None:
    definitions = schema("reports")["$defs"]
    row = definitions["StableRow"]["properties"]
    assert row["energy"]["description"].startswith("Most energy that a stable run may have, J")


def test_declarations_have_the_fields_of_their_schema() -> None:
    """The schema is another program's as well; each field is read, and is needed where it says."""
    definitions = schema("scenarios")["$defs"]
    tables = (BenchTable, KeepTable, ScenarioTable, SweepTable)
    for table in tables:
        definition = definitions[table.__name__]
        read_table = msgspec.json.schema_components([table])[1][table.__name__]
        read_table = json.loads(json.dumps(read_table))
        assert set(read_table["properties"]) == set(definition["properties"]), table
        assert set(read_table["required"]) == set(definition["required"]), table
        for name, form in read_table["properties"].items():
            for key in ("type", "enum", "exclusiveMinimum", "maximum", "pattern", "default"):
                assert form.get(key) == definition["properties"][name].get(key), (table, name, key)
    fields = set(definitions["ModelFile"]["properties"])
    assert fields == set(DeclarationFile.__struct_fields__)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[scenario]", "Expected ']]' at the end of an array declaration"),
        ("[[scenario]]", "Object missing required field `name` - at `$.scenario[0]`"),
        ("[bench]\nband = 2", "Expected `float` <= 1.0 - at `$.bench.band`"),
        ("[[scenario]]\nname = 'a'\n" * 2, "the name `a` is given twice"),
        ("[[sweep]]\nname = 's'\nvary = {}\nscenario = 'b'", "no scenario is called `b`"),
    ],
)
def test_what_is_no_declaration_is_told(text: str, message: str) -> None:
    with pytest.raises(DeclarationError) as caught:
        parse_declarations("a.toml", text)
    assert str(caught.value).startswith(message)
