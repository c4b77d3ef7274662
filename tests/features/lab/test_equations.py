"""Labs without an engine: expressions, solutions with events, what NumPy and SciPy make of them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.run.child import LIMITS
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.lab.equations.equation_trial import EquationEngine
from coursebuild.features.lab.equations.formula import (
    ARITIES,
    Program,
    compile_condition,
    compile_formula,
)
from coursebuild.features.lab.equations.reference import (
    CurveRun,
    compare_states,
    compare_values,
    evaluate,
)
from support.fixture_cases import fixture_text
from support.text_cases import parse_lab

PATIENCE = math.inf
NAMES = {"x": 0, "y": 1}


@pytest.fixture(scope="module")
def engine() -> Iterator[EquationEngine]:
    engine = EquationEngine(LIMITS.memory)
    yield engine
    engine.close()


def config_of(text: str, kind: str = "ode") -> dict[str, Any]:
    parsed_lab = parse_lab(text, kind)
    assert parsed_lab.diagnostics == ()
    assert parsed_lab.value is not None
    data: dict[str, Any] = json.loads(parsed_lab.value.config)
    return data


def run_of(engine: EquationEngine, config: dict[str, Any], *values: float) -> CurveRun:
    attempt = {"values": values, "claims": []}
    return engine.run({"config": config, "attempts": [attempt]}, 60)[0]


def page_values(
    engine: EquationEngine, programs: list[Program], x: float, y: float
) -> list[float | None]:
    axis = {"min": x, "max": x + 1, "at": x}
    config = {"axis": axis, "where": [], "states": [], "events": [], "plots": [], "readouts": []}
    attempt = {"values": [y], "claims": [(program, x) for program in programs]}
    request = {"config": {**config, "controls": [{}], "goal": None}, "attempts": [attempt]}
    return engine.run(request, 60)[0].claims


def excerpt(text: str) -> Excerpt:
    return Source("a.md", text).excerpt()


def program_of(text: str) -> Program:
    compilation = compile_formula(excerpt(text), NAMES)
    assert compilation.value is not None, compilation.diagnostics
    return compilation.value


NUMBERS = st.sampled_from(["x", "y", "0", "1", "2.5", "1e300", "-3", "nan", "1e-310"])
EXACT = st.recursive(
    NUMBERS,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from("+ - * / %".split()), inner),
        st.builds("({} {} {})".format, inner, st.sampled_from("< <= > >= == !=".split()), inner),
        st.builds("({} {} {})".format, inner, st.sampled_from(["and", "or"]), inner),
        st.builds("({} if {} else {})".format, inner, inner, inner),
        st.builds("{}({})".format, st.sampled_from("abs sign floor ceil sqrt".split()), inner),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner),
        st.builds("(not {})".format, inner),
        st.builds("(-{})".format, inner),
    ),
    max_leaves=12,
)
"""Expressions whose operations every machine rounds in the same way."""


@given(text=EXACT, x=st.floats(width=32), y=st.sampled_from([0.0, -1.5, 7.0]))
def test_expression_has_the_same_value_in_page_and_numpy(
    engine: EquationEngine, text: str, x: float, y: float
) -> None:
    if not math.isfinite(x):
        return
    program = program_of(text)
    expected = float(evaluate(program, [np.float64(x), np.float64(y)]))
    (value,) = page_values(engine, [program], x, y)
    assert value == (expected if math.isfinite(expected) else None)


def test_functions_have_the_same_values_in_page_and_numpy(engine: EquationEngine) -> None:
    calls = [f"{name}({', '.join('xy'[:count])})" for name, count in sorted(ARITIES.items())]
    calls += ["x**y", "x**0.5", "x**-2"]
    programs = [program_of(call) for call in calls]
    for x, y in ((0.3, 2.0), (-0.7, 3.0), (1.0, math.inf), (12.5, -0.5), (0.0, 0.0)):
        values = page_values(engine, programs, x, y) if math.isfinite(y) else []
        for call, program, value in zip(calls, programs, values, strict=False):
            expected = float(evaluate(program, [np.float64(x), np.float64(y)]))
            if math.isfinite(expected):
                assert value == pytest.approx(expected, rel=1e-14, abs=1e-300), (call, x, y)
            else:
                assert value is None, (call, x, y)


@given(st.text(alphabet="xyz0123456789.()+-*/%<>=!&|?,;: \\\n\t'\"#[]{}^~lambdifo√θ𝒙\x00\ud800"))
def test_any_text_is_a_formula_or_a_mistake_inside_it(text: str) -> None:
    for compilation in (
        compile_formula(excerpt(text), NAMES),
        compile_condition(excerpt(text), NAMES),
    ):
        assert (compilation.value is None) == bool(compilation.diagnostics)
        for diagnostic in compilation.diagnostics:
            assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)


@pytest.mark.parametrize(
    "text",
    ["(" * 900 + "x" + ")" * 90, "-" * 999 + "x", "x" * 1001, "9" * 999, "x+" * 499 + "x"],
    ids=["brackets", "signs", "long", "digits", "terms"],
)
def test_hostile_formula_ends_soon(engine: EquationEngine, text: str) -> None:
    compilation = compile_formula(excerpt(text), NAMES)
    if compilation.value is not None:
        assert len(page_values(engine, [compilation.value], 1.0, 1.0)) == 1


@given(st.text(max_size=80), st.sampled_from(["plot", "ode"]))
def test_any_text_of_a_lab_can_be_read(text: str, kind: str) -> None:
    parsed_lab = parse_lab(text, kind)
    assert (parsed_lab.value is None) == bool(parsed_lab.diagnostics)


def test_solution_is_that_of_the_equation(engine: EquationEngine) -> None:
    for rate, start, exact in (
        ("-2*y", 1, lambda t: np.exp(-2 * t)),
        ("y*(1 - y)", 0.1, lambda t: 1 / (1 + 9 * np.exp(-t))),
        ("cos(30*t)*30", 0, lambda t: np.sin(30 * t)),
        ("1e-9*t", 0, lambda t: 5e-10 * t**2),
    ):
        config = config_of(
            f't = {{max = 10}}\nstates = {{y = {{start = {start}, rate = "{rate}"}}}}'
        )
        run = run_of(engine, config)
        times, expected = np.array(run.times), exact(np.array(run.times))
        assert len(times) == 601
        assert (
            np.abs(np.array(run.states[0], float) - expected).max() < 1e-7 * np.abs(expected).max()
        )


BALL = fixture_text("documents/equations_ball.toml")


def test_ball_that_starts_on_the_floor_bounces_at_its_times_and_stops(
    engine: EquationEngine,
) -> None:
    """Each flight is shorter by the same factor, until it lasts less than a step of the motion."""
    run = run_of(engine, config_of(BALL), 0.5)
    flights = 0.5 ** np.arange(len(run.events))
    assert [event["t"] for event in run.events] == pytest.approx(np.cumsum(flights), abs=1e-9)
    assert len(run.events) == 16  # 5 m/s halved sixteen times is below 0.0001 m/s
    assert run.end == run.events[-1]["t"]
    assert run.failure is None
    assert run.states[1][-1] == pytest.approx(5 / 2**16)


def test_events_in_both_directions_and_of_two_kinds_come_in_order(engine: EquationEngine) -> None:
    config = config_of("""
t = {max = 7}
states = {y = {start = 1, rate = "z"}, z = {start = 0, rate = "-y"}, n = {start = 0, rate = 0}}
events = [{when = "y == 0", set = {n = "n + 1"}}, {when = "z > 0.5", set = {n = "n + 10"}}]
""")
    run = run_of(engine, config)
    times = [(event["index"], event["t"]) for event in run.events]
    expected = [(0, np.pi / 2), (1, 7 * np.pi / 6), (0, 3 * np.pi / 2)]
    assert [index for index, _ in times] == [index for index, _ in expected]
    assert [t for _, t in times] == pytest.approx([t for _, t in expected], abs=1e-8)
    assert run.states[2][-1] == 12
    assert compare_states(config, [], run, 7, PATIENCE).difference < 1e-9


def test_event_that_changes_its_own_quantity_or_none_comes_again_in_time(
    engine: EquationEngine,
) -> None:
    """A neuron fires at each threshold; a body that enters water is slowed once."""
    neuron = config_of("""
t = {max = 3.5}
states = {v = {start = 0, rate = 1}}
events = [{when = "v > 1", set = {v = 0}}]
""")
    run = run_of(engine, neuron)
    assert [event["t"] for event in run.events] == pytest.approx([1, 2, 3])
    assert compare_states(neuron, [], run, 3.5, PATIENCE).difference < 1e-9
    water = config_of("""
t = {max = 3}
states = {h = {start = 1, rate = "v"}, v = {start = -1, rate = 0}}
events = [{when = "h < 0", set = {v = "v/2"}}]
""")
    run = run_of(engine, water)
    assert len(run.events) == 1
    assert (run.end, run.states[0][-1]) == (3, pytest.approx(-1))
    assert compare_states(water, [], run, 3, PATIENCE).difference < 1e-9


@pytest.mark.parametrize(("height", "end"), [(1, math.sqrt(0.2)), (0, 0)])
def test_body_laid_on_the_floor_does_not_fall_through_it(
    engine: EquationEngine, height: float, end: float
) -> None:
    config = config_of(f"""
t = {{max = 3}}
states = {{h = {{start = {height}, rate = "v"}}, v = {{start = 0, rate = -10}}}}
events = [{{when = "h < 0", set = {{v = 0}}}}]
""")
    run = run_of(engine, config)
    assert run.failure is not None
    assert run.failure["kind"] == "events"
    assert run.end == pytest.approx(end)


def test_condition_that_begins_to_hold_at_the_start_is_no_event(engine: EquationEngine) -> None:
    config = config_of("""
t = {max = 3}
states = {y = {start = 0, rate = "1 - t"}}
events = [{when = "y > 0", stop = true}]
""")
    run = run_of(engine, config)
    assert (run.events, run.end) == ([], 3)
    assert compare_states(config, [], run, 3, PATIENCE).difference < 1e-9


def test_scipy_agrees_and_would_notice_another_motion_or_a_lost_event(
    engine: EquationEngine,
) -> None:
    config = config_of(BALL)
    run = run_of(engine, config, 0.8)
    assert compare_states(config, [0.8], run, 20, PATIENCE).difference < 1e-9
    wrong_state = replace(
        run, states=[[h + 1e-5 for h in run.states[0] if h is not None], run.states[1]]
    )
    assert compare_states(config, [0.8], wrong_state, 20, PATIENCE).difference > 1e-6
    late_event = replace(
        run, events=[{"t": run.events[0]["t"] + 0.01, "index": 0}, *run.events[1:]]
    )
    assert "no event" in compare_states(config, [0.8], late_event, 20, PATIENCE).problem or (
        compare_states(config, [0.8], late_event, 20, PATIENCE).problem
    )


def test_numpy_would_notice_another_curve(engine: EquationEngine) -> None:
    config = config_of('x = {max = 2}\nplots = [{traces = [{label = "a", expr = "x**2"}]}]', "plot")
    run = run_of(engine, config)
    assert compare_values(config, [], run).difference == 0
    line = [1.00001 * y for y in run.plots[0]["traces"][0]]
    wrong_curve = replace(run, plots=[{**run.plots[0], "traces": [line]}])
    assert compare_values(config, [], wrong_curve).difference == pytest.approx(1e-5, rel=0.5)


def test_patience_with_scipy_ends(engine: EquationEngine) -> None:
    config = config_of(BALL)
    comparison = compare_states(config, [0.8], run_of(engine, config, 0.8), 20, patience=0)
    assert comparison.problem == "SciPy needs too many steps"
