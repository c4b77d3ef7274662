"""Recorded reports: the same bytes, nothing read that is not one, and figures out of their band."""

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
from mjbench.reports import Reach
from mjbench.reports.records import (
    BENCH,
    STABILITY,
    Departure,
    RecordError,
    case_departures,
    scene_departures,
)
from mjbench.reports.scene_report import (
    FigureLine,
    FittedOrder,
    OrderRow,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)
from mjbench.schemas import schema_text
from samples.cases import case
from samples.reports import (
    FIRST,
    MACHINE,
    awkward,
    diverged_row,
    interval,
    row,
    scenario,
    scene,
    swing,
)

GOOD = BENCH.encode(scene())
HEAD = b'{"holds": "mjbench bench"'


def test_what_is_written_is_read() -> None:
    for report in (
        scene(),
        scene(scenario([])),
        scene(scenario([diverged_row(), row("Ω\n", 1e-300)])),
    ):
        data = BENCH.encode(report)
        assert BENCH.decode(data) == report
        assert BENCH.encode(BENCH.decode(data)) == data
    data = STABILITY.encode((case(),))
    assert STABILITY.decode(data) == (case(),)


def test_a_row_is_a_line_and_keys_are_sorted() -> None:
    lines = GOOD.decode().splitlines()
    assert lines[:2] == ["{", ' "holds": "mjbench bench",'] and lines[-2] == ' "version": 5'
    assert sum('"timestep"' in line for line in lines) == len(swing().rows)
    assert GOOD.endswith(b"}\n")

    def keys(value: object) -> None:
        if isinstance(value, dict):
            assert list(value) == sorted(value)
            list(map(keys, value.values()))
        elif isinstance(value, list):
            list(map(keys, value))

    keys(json.loads(GOOD))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is damaged: Input data was truncated"),
        (b"\xff", "is damaged: JSON is malformed: invalid character (byte 0)"),
        (b"[" * 100_000, "is damaged: "),
        (b"[]", "holds no report of `mjbench bench`"),
        (HEAD + b', "version": 3}', "has version 3 of its format, and this one is 5"),
        (HEAD + b', "version": 5}', "is damaged: Object missing required field `scene`"),
        (GOOD.replace(b'"value": 0.1}', b'"value": 1e999}', 1), "is damaged: Number out of range"),
        (
            GOOD.replace(b'"name": "swing"', b'"name": 7'),
            "is damaged: Expected `str`, got `int` - at `$.scene.scenarios[0].name`",
        ),
        (
            GOOD.replace(b'"cpu"', b'"cup"'),
            "is damaged: Object contains unknown field `cup` - at `$.scene.machine`",
        ),
    ],
)
def test_what_is_no_report(data: bytes, message: str) -> None:
    with pytest.raises(RecordError) as caught:
        BENCH.decode(data)
    assert str(caught.value).startswith(message)


def departures_between(old: ScenarioReport, new: ScenarioReport) -> list[Departure]:
    return list(scene_departures(scene(old), scene(new), BenchTable()))


def of_rows(old: WorkPrecisionRow, new: WorkPrecisionRow) -> list[tuple[str, ...]]:
    departures = departures_between(scenario([old]), scenario([new]))
    return [
        (departure.figure, departure.recorded, departure.measured, departure.band)
        for departure in departures
    ]


def test_times_and_what_follows_from_them_do_not_matter() -> None:
    slow = [replace(r, cost=interval(9.0), seconds=None, front=True) for r in swing().rows]
    slow_report = replace(
        swing(), rows=tuple(slow), verdict=scenario([]).verdict, source="elsewhere"
    )
    new = scene(slow_report, machine=replace(MACHINE, cpu="another"), digest="1" * 64)
    assert scene_departures(scene(), new, BenchTable()) == ()


def test_an_error_that_left_its_band_is_told_exactly() -> None:
    new = replace(swing(), rows=(*swing().rows[:-1], replace(swing().rows[-1], position=(1, 1))))
    first, last = departures_between(swing(), new)
    assert first == Departure("swing", "RK4 at 1 ms", "error of position", "1.92e-08", "1", "± 5 %")
    assert last.figure == "error of position at the end"


@pytest.mark.parametrize(
    ("old", "new", "departure"),
    [
        ({"position": (1e-3, 0)}, {"position": (1.0499e-3, 0)}, None),
        (
            {"position": (1e-3, 0)},
            {"position": (1.0501e-3, 0)},
            ("error of position", "0.001", "0.0010501", "± 5 %"),
        ),
        ({"position": (1e-11, 0)}, {"position": (1.9e-11, 0)}, None),  # ten floors are 1e-11
        (
            {"position": (1e-11, 0)},
            {"position": (2.1e-11, 0)},
            ("error of position", "1e-11", "2.1e-11", "± 5 %"),
        ),
        ({}, {"status": "diverged"}, ("status", "ok", "diverged", "the same")),
        ({"own": True}, {}, ("own setting", "yes", "no", "the same")),
        ({}, {"refsafe": True}, ("refsafe", "no", "yes", "the same")),
        (
            {"energy_drift": -0.0604},
            {"energy_drift": 0.0664},
            ("energy drift", "-0.0604", "0.0664", "± 5 %"),
        ),
        ({"energy_drift": 1e-14}, {"energy_drift": -3e-13}, None),
        ({"momentum_drift": 1e-3}, {}, ("momentum drift", "0.001", "nothing", "the same")),
        ({"penetration": 0.01}, {"penetration": 0.02}, ("penetration", "0.01", "0.02", "± 5 %")),
        ({"model_error": 0.3}, {"model_error": 0.1}, ("model error", "0.3", "0.1", "± 5 %")),
        ({"figure": (1, 1)}, {"figure": None}, ("error of figure", "1", "nothing", "the same")),
    ],
)
def test_which_figures_of_a_row_depart_and_how_it_is_said(
    old: Any, new: Any, departure: tuple[str, ...] | None
) -> None:
    assert of_rows(row(**old), row(**new)) == ([] if departure is None else [departure])


def test_drifts_of_a_chaotic_scenario_or_a_lost_run_say_nothing() -> None:
    first, second = row(energy_drift=0.1), row(energy_drift=0.2)
    whole, chaotic = scenario([first]), scenario([first], horizon=0.5)
    assert len(departures_between(whole, scenario([second]))) == 1
    assert departures_between(chaotic, scenario([second], horizon=0.5)) == []
    for old, new in ((whole, scenario([second], horizon=0.5)), (chaotic, scenario([second]))):
        assert [departure.figure for departure in departures_between(old, new)] == ["horizon"]
    slow = {"status": "slow-growth", "reasons": ("it grows",)}
    assert of_rows(replace(first, **slow), replace(second, **slow)) == []


def test_no_error_is_known_better_than_the_worse_of_both_references() -> None:
    old, new = (row(velocity=(x, x), position=(x, x)) for x in (1e-3, 2e-3))
    assert len(departures_between(scenario([old]), scenario([new]))) == 4
    for floor, new_floor in ((1e-4, 1e-11), (1e-11, 1e-4)):
        old_report = scenario([old], floor=floor, velocity_floor=floor)
        new_report = scenario([new], floor=new_floor, velocity_floor=new_floor)
        assert departures_between(old_report, new_report) == []


def test_settings_and_scenarios_that_come_and_go() -> None:
    new = scenario([row("RK4", solver="CG")])
    departures = departures_between(scenario([row("Euler", evaluations=500)]), new)
    assert [(d.setting, d.figure, d.recorded, d.measured) for d in departures] == [
        ("Euler at 2 ms", "setting", "there", "nothing"),
        ("RK4 at 2 ms, CG", "setting", "nothing", "there"),
    ]
    departures = departures_between(scenario([]), scenario([], name="other"))
    assert [(d.where, d.recorded, d.measured) for d in departures] == [
        ("swing", "there", "nothing"),
        ("other", "nothing", "there"),
    ]


def test_what_is_said_of_the_whole_scenario() -> None:
    new = scenario([], duration=2.0, horizon=0.5, hold=0.1, reference="self", figure="x (m)")
    assert [(d.figure, d.recorded, d.measured) for d in departures_between(scenario([]), new)] == [
        ("duration", "1", "2"),
        ("hold", "0", "0.1"),
        ("horizon", "1", "0.5"),
        ("reference", "ode", "self"),
        ("figure", "nothing", "x (m)"),
    ]


@pytest.mark.parametrize(
    ("was", "now", "expected"),
    [
        (0.04, 0.0403, None),
        (0.04, 0.041, ("0.04", "0.041", "± 1 %")),
        (0.04, "all", ("40 ms", "all", "the same")),
        ("all", 0.04, ("all", "40 ms", "the same")),
    ],
)
def test_largest_stable_timesteps(
    was: Reach, now: Reach, expected: tuple[str, str, str] | None
) -> None:
    def stable(largest: Reach) -> ScenarioReport:
        return scenario([], stable=(StableRow("Euler", largest, (1e-3, 0.1), None, 1.0, None),))

    departures = [
        (d.recorded, d.measured, d.band) for d in departures_between(stable(was), stable(now))
    ]
    assert departures == ([] if expected is None else [expected])


def test_orders_that_can_be_fitted_no_more() -> None:
    old = scenario([], orders=(OrderRow("RK4", FIRST, None, FittedOrder(3.9, 0.1, 0.1)),))
    new = scenario([], orders=(OrderRow("RK4", None, None, FittedOrder(3.94, 0.1, 0.1)),))
    (departure,) = departures_between(old, new)
    assert departure == Departure("swing", "RK4", "order of position", "1", "nothing", "the same")


def test_a_case_that_is_gone_is_a_departure() -> None:
    assert case_departures([case()], [case()]) == ()
    (departure,) = case_departures([case()], [])
    assert departure == Departure("spring", "", "case", "there", "nothing", "the same")


def figure(value: float | None, exact: float | None = 1.0) -> Any:
    return replace(case(), figures=(FigureLine("growth", "m", "Euler", value, exact, "a law"),))


def test_what_is_known_exactly_is_compared_by_how_far_it_is_off() -> None:
    assert case_departures([figure(1 + 1e-4)], [figure(1 + 1.04e-4)]) == ()
    (departure,) = case_departures([figure(1 + 1e-4)], [figure(1 + 2e-4)])
    assert departure == Departure(
        "spring", "Euler", "growth, against theory", "0.0001", "0.0002", "± 5 %"
    )
    assert case_departures([figure(-2e-15, 0.0)], [figure(3e-15, 0.0)]) == ()
    assert case_departures([figure(2.0, None)], [figure(2.05, None)]) == ()
    assert len(case_departures([figure(2.0, None)], [figure(2.2, None)])) == 1


def test_boundaries_and_runs_of_cases() -> None:
    line = StableRow("Euler", "all", (1e-3, 1.0), (0.3, 0.4), 9.0, None)
    old, run = case(), replace(case().errors[0], status="through")
    new = replace(old, boundaries=(line, *old.boundaries[1:]), errors=(run, *old.errors[1:]))
    departures = case_departures([old], [new])
    assert [
        (departure.setting, departure.figure, departure.recorded, departure.measured)
        for departure in departures
    ] == [
        ("Euler", "largest stable timestep", "200 ms", "all"),
        ("Euler", "monotone", "yes", "no"),
        ("Euler at 10 ms", "status", "ok", "through"),
    ]
    fuzzy = replace(old, boundaries=(replace(line, largest=0.22), *old.boundaries[1:]))
    for pair in ((old, fuzzy), (fuzzy, old)):
        figures = {departure.figure for departure in case_departures(pair[:1], pair[1:])}
        assert figures == {"monotone"}, "a limit beyond which some are stable is fuzzy"


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
