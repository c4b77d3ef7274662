"""What stands between this tool and mjbench: reports, declarations, names of hard cases."""

from __future__ import annotations

import json

import msgspec
from msgspec import Struct

from coursebuild.core.model import diet_findings, measurements, report_files
from coursebuild.core.syntax.course_schema import json_schema
from mjbench.reports import records
from mjbench.schemas import schema_text
from samples.reports import scene, swing
from support.bench_reports import derived
from support.bench_reports import scene as shown_scene

REPORTS = json.loads(schema_text("reports"))


def test_a_report_is_read_as_it_is_written() -> None:
    assert (
        report_files.BENCH.decode(records.BENCH.encode(scene(derived(swing()))), "arm")
        == shown_scene()
    )
    assert report_files.VERSION == records.VERSION
    kinds = (report_files.BENCH, report_files.ENGINES, report_files.DIET, report_files.STABILITY)
    choices = {part["properties"]["holds"]["const"]: part for part in REPORTS["oneOf"]}
    assert {f"mjbench {kind.name}" for kind in kinds} == set(choices)
    for kind in kinds:
        assert kind.field in choices[f"mjbench {kind.name}"]["properties"]


def test_nothing_is_read_that_the_schema_of_reports_does_not_have() -> None:
    structs = [
        value
        for module in (measurements, diet_findings)
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Struct) and value is not Struct
    ]
    assert len(structs) > 20
    for struct in structs:
        definition = REPORTS["$defs"].get(struct.__name__)
        if definition is None:  # a base of others
            continue
        read = msgspec.json.schema_components([struct])[1][struct.__name__]
        assert read["properties"].keys() <= definition["properties"].keys(), struct
        assert set(read["required"]) <= set(definition["required"]), struct


def test_declarations_are_those_that_mjbench_reads() -> None:
    schemas = [json.loads(json_schema("model")), json.loads(schema_text("scenarios"))]
    for schema in schemas:
        del schema["title"]
    assert schemas[0] == schemas[1], "make it again: `coursebuild schema model`"
