"""What a check prints, and measurements as JSON."""

from __future__ import annotations

import json
import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model.measurements import Interval
from coursebuild.features.bench.commands.measurement import (
    Departure,
    Measurement,
    RecordCheck,
    format_checks,
    measurement_json,
)
from coursebuild.report import Style
from support.bench_reports import row, scenario, scene
from support.fixture_cases import check_text

HERE = Path(__file__).parent
RECORD_CHECK = RecordCheck(
    "arm",
    "content/reports/arm.bench.json",
    (
        Departure("swing", "RK4 at 1 ms", "error of position", "1.92e-08", "3.1e-08", "± 5 %"),
        Departure("swing", "", "reference", "ode", "self", "the same"),
        Departure("drop", "Euler", "order of velocity", "1", "nothing", "± 0.05"),
    ),
    ("recorded with MuJoCo 3.13.0, measured with 3.14.0",),
)


def test_departures_as_text(rewriting: bool) -> None:
    text = format_checks([RECORD_CHECK, replace(RECORD_CHECK, name="leg", departures=())], Style())
    check_text(HERE / "departures.txt", text, rewriting=rewriting)


@given(value=st.floats())
def test_json_has_no_number_that_is_none(value: float) -> None:
    odd = replace(row(), position=(value, value), cost=Interval(value, value, value))
    report = scene(replace(scenario([row()]), rows=(odd,), horizon=value, floor=value))
    text = measurement_json({"scenes": [report]}, Measurement((report,)))
    (row_value,) = json.loads(text)["scenes"][0]["scenarios"][0]["rows"]
    assert row_value["position"][0] == (value if math.isfinite(value) else None)
