"""Speed against error as text and as JSON."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model.measurements import FigureLine, Interval, RowVerdict
from coursebuild.features.bench.commands.bench import bench_text
from coursebuild.features.bench.commands.measurement import (
    Departure,
    Measurement,
    RecordCheck,
    format_checks,
    measurement_json,
)
from coursebuild.report import Style
from coursebuild.report.text import Column, cells, fit, table
from support.bench_reports import awkward, row, scenario, scene
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


def test_text_is_as_wide_as_the_terminal(rewriting: bool) -> None:
    still = replace(scene(), model="still", scenarios=())
    figures = (
        FigureLine("slip", "m", "Euler", 0.00335, 0.0, "as declared"),
        FigureLine("slip", "m", "RK4", 0.0031, 0.0, "as declared"),
        FigureLine("slip", "m", "discrete", 0.00335, 0.0, "as declared"),
    )
    scenes = [
        scene(replace(scene().scenarios[0], figures=figures)),
        scene(awkward(), quick=True),
        scene(scenario([])),
        still,
    ]
    for width in (80, 160):
        text = bench_text(scenes, Style(width=width))
        check_text(HERE / f"bench-{width}.txt", text, rewriting=rewriting)
        assert all(cells(line) <= width for line in text.splitlines())


def test_how_long_chaotic_runs_last_is_not_left_out_on_a_narrow_terminal() -> None:
    chaotic = scene().scenarios[0]
    rows = tuple(replace(r, parted=2.42 if r.own else None) for r in chaotic.rows)
    text = bench_text([scene(replace(chaotic, rows=rows))], Style(width=80))
    assert "Error passes 0.1 after" in text and " 2.42 s" in text


def test_departures_as_text(rewriting: bool) -> None:
    text = format_checks([RECORD_CHECK, replace(RECORD_CHECK, name="leg", departures=())], Style())
    check_text(HERE / "departures.txt", text, rewriting=rewriting)


def test_colour_marks_the_own_setting_the_front_and_what_was_lost() -> None:
    text = bench_text([scene()], Style(colour=True, width=80))
    assert re.search(r"\x1b\[1m>   Euler at 2 ms .*\x1b\[0m", text)
    assert re.search(r"\x1b\[32m \*  RK4 at 20 ms .*\x1b\[0m", text)
    assert re.search(r"\x1b\[1;31m +Euler at 50 ms\x1b\[0m", text)
    assert re.sub(r"\x1b\[[\d;]*m", "", text) == bench_text([scene()], Style(width=80))


@pytest.mark.parametrize(
    ("on_front", "noticeable", "colour"),
    [(True, False, "32"), (True, True, "1;33"), (False, False, "1;33"), (True, None, "32")],
)
def test_a_verdict_is_green_where_the_own_setting_is_as_good_as_any(
    on_front: bool, noticeable: bool | None, colour: str
) -> None:
    verdict = RowVerdict(on_front, None, noticeable, "So it is.")
    text = bench_text([scene(scenario([row()], verdict=verdict))], Style(colour=True, width=80))
    assert f"\x1b[{colour}m    So it is." in text


def test_names_cannot_change_the_terminal() -> None:
    name = "a\x1b[31m\u202e\n\t名前"
    odd = scenario([row(name)], name=name, title=name, source=name, notes=(name,))
    text = bench_text([scene(odd, model=name)], Style(width=80))
    assert "\x1b" not in text and "\u202e" not in text
    assert "名前" in text


def test_what_a_table_has_no_room_for_comes_in_the_next() -> None:
    """Wide characters take two cells."""
    columns = [
        Column("name", ("a", "名前"), 0, left=True),
        Column("wide", ("x" * 30, "y"), 1, left=True),
        Column("n", ("1", "22"), 2),
        Column("none", ("", " "), 0),
        Column("m", ("3", "4"), 1),
    ]

    def tables(width: int) -> list[list[str]]:
        return [table(group) for group in fit(columns, width)]

    whole = [
        "name  wide                             n  m",
        "a     xxxxxxxxxxxxxxxxxxxxxxxxxxxxxx   1  3",
        "名前  y                               22  4",
    ]
    assert tables(80) == tables(43) == [whole]
    wide, thin = (
        ["name  wide", "a     " + "x" * 30, "名前  y"],
        ["name   n", "a      1", "名前  22"],
    )
    assert tables(38) == tables(20) == [wide, ["name   n  m", "a      1  3", "名前  22  4"]]
    assert tables(10) == [wide, ["name  m", "a     3", "名前  4"], thin]
    assert tables(40)[1:] == [thin]
    assert [table(group) for group in fit(columns[:1], 1)] == [["name", "a", "名前"]]


@given(value=st.floats())
def test_json_has_no_number_that_is_none(value: float) -> None:
    odd = replace(row(), position=(value, value), cost=Interval(value, value, value))
    report = scene(scenario([odd], horizon=value, floor=value))
    text = measurement_json({"scenes": [report]}, Measurement((report,)))
    (row_value,) = json.loads(text)["scenes"][0]["scenarios"][0]["rows"]
    assert row_value["position"][0] == (value if math.isfinite(value) else None)
