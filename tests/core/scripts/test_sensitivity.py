"""Which printed digits repeat, given what was printed with initial states moved."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter, Recording
from coursebuild.core.model.results import Outcome, ScriptRun, Trace
from coursebuild.core.scripts.noise_warnings import noise_warnings
from coursebuild.core.scripts.sensitivity import Sensitivity, Standing, is_worth_moving, sensitivity
from support.fixture_cases import fixture_tables
from support.sample_lessons import DIGITS, EXACT, course, describe, document, recording, tolerance

CASES = fixture_tables("sensitivity")

TRACE = Trace((), (), (), ("mujoco",), "")


def run(stdout: str, states: Sequence[str] = (), *, is_perturbed: bool = True) -> ScriptRun:
    trace = replace(TRACE, is_perturbed=is_perturbed, states=tuple(states))
    return ScriptRun("examples/a.py", Outcome.OK, 0, stdout, "", 1.0, trace=trace)


def measure(
    recorded: str | Recording,
    *outputs: str | ScriptRun,
    comparison: Comparison = EXACT,
    base: str | None = None,
    filters: tuple[Filter, ...] = (),
    finer: tuple[str, ...] = (),
    shifted: tuple[str, ...] = (),
) -> Sensitivity:
    """What runs that printed this say of a recorded output; four runs, the last repeated.

    `finer` was printed with half and with a quarter of the timestep, `shifted` with steps shifted
    by a third, two thirds and a whole.
    """
    block = recording(recorded) if isinstance(recorded, str) else recorded
    assert base is not None or isinstance(recorded, str)
    printed = base if base is not None else str(recorded)
    runs = [output if isinstance(output, ScriptRun) else run(output) for output in outputs]
    runs += [runs[-1]] * (4 - len(runs))
    sample_course = course(
        document("", "content/lessons/1.1-a.md"), comparison=comparison, filters=filters
    )
    finer_runs = [run(text) for text in finer]
    shifted_runs = [run(text) for text in shifted]
    return sensitivity(
        *(sample_course, "examples/a.py", "1.1", [block], run(printed)),
        *(runs, finer_runs, shifted_runs),
    )


def digits(result: Sensitivity) -> list[tuple[str, int, int, str]]:
    assert result.standing is Standing.MEASURED
    assert result.flips == ()
    return [(d.printed, d.digits, d.repeat, d.instead) for d in result.doubts]


def flips(result: Sensitivity) -> list[tuple[str, str]]:
    assert result.standing is Standing.MEASURED
    assert result.doubts == ()
    return [(flip.printed, flip.other) for flip in result.flips]


def warnings(result: Sensitivity) -> list[str]:
    return [describe(diagnostic) for diagnostic in noise_warnings(result)]


# --- numbers


@pytest.mark.parametrize(("recorded", "moved_output", "expected"), CASES["digits"])
def test_digits_that_hold(
    recorded: str, moved_output: list[str], expected: list[str | int]
) -> None:
    text = "value {} m"
    result = measure(text.format(recorded), *(text.format(value) for value in moved_output))
    assert digits(result) == [tuple(expected)]


def test_what_a_filter_takes_out_does_not_count() -> None:
    filters = (Filter("took [0-9.]+ s", "took TIME"),)
    result = measure("x 1.5, took 3.1 s", "x 1.5, took 4.2 s", filters=filters)
    assert digits(result) == []
    volatile = Comparison(volatile="[0-9.]+ s")
    result = measure("x 1.5, took 3.1 s", "x 1.5, took 4.2 s", comparison=volatile)
    assert digits(result) == []


def test_values_within_a_tolerance_are_compared_with_those_of_the_run() -> None:
    comparison = tolerance("1e-3")
    result = measure("x 1.2345", "x 1.2347", comparison=comparison, base="x 1.2347")
    assert digits(result) == [], "moving has changed nothing"
    result = measure("x 1.2345", "x 1.2348", comparison=comparison, base="x 1.2347")
    assert digits(result) == [("1.2347", 5, 4, "1.235")]


@pytest.mark.parametrize(("recorded", "moved_output", "finer", "expected"), CASES["converged"])
def test_digits_that_repeat_and_digits_that_are_converged(
    recorded: str, moved_output: str, finer: str, expected: list[int | str]
) -> None:
    text = "value {} m"
    half, quarter = map(text.format, finer.split())
    result = measure(text.format(recorded), text.format(moved_output), finer=(half, quarter))
    values = [(d.repeat, d.converged, d.instead, d.digits) for d in result.doubts]
    assert values == ([tuple(expected)] if expected else [])
    assert result.unhalved == ""
    assert warnings(result) == warnings(measure(text.format(recorded), text.format(moved_output)))


@pytest.mark.parametrize(("printed", "finer", "shifted", "expected"), CASES["sampled"])
def test_a_time_that_is_looked_for_at_every_step_is_known_to_a_step(
    printed: str, finer: str, shifted: str, expected: list[int | str]
) -> None:
    text = "value {}"
    half, quarter, *later = map(text.format, f"{finer} {shifted}".split())
    result = measure(*(text.format(printed),) * 2, finer=(half, quarter), shifted=tuple(later))
    values = [(d.converged, d.instead, d.sampled) for d in result.doubts]
    assert values == ([tuple(expected)] if expected else [])


def test_reasons_why_convergence_is_not_measured() -> None:
    sample_course, block = course(document("", "content/lessons/1.1-a.md")), recording("x 1.25")
    lost = replace(run(""), outcome=Outcome.TIMEOUT)
    for finer_runs, reason in (
        ([], "it was not run with shorter timesteps"),
        ([run("x 1.24", is_perturbed=False)] * 2, "no step of it can be halved"),
        ([lost, lost], "it does not run to its end with half the"),
        ([run("x 1.24"), lost], "it does not run to its end with a quarter of the"),
    ):
        runs = [run("x 1.26")] * 4
        result = sensitivity(
            sample_course, "examples/a.py", "1.1", [block], run("x 1.25"), runs, finer_runs
        )
        assert result.unhalved.startswith(reason)
        assert [(d.repeat, d.converged, d.quartered) for d in result.doubts] == [(2, None, "")]


# --- text


@pytest.mark.parametrize(("recorded", "moved_output", "expected"), CASES["changing_texts"])
def test_text_that_changes(recorded: str, moved_output: str, expected: list[list[str]]) -> None:
    assert [[*flip] for flip in flips(measure(recorded, moved_output))] == expected


# --- scripts


def test_states_that_are_lost_end_infinitely_far_apart() -> None:
    lost_runs = [run("x 1", [f"0 1 0x1p+0 0x0p+0 {x} 0x0p+0"]) for x in ("nan", "0x1p+0")]
    result = measure("x 1", *lost_runs, *lost_runs)
    assert result.amplification == math.inf
    assert result.chaotic


@pytest.mark.parametrize(
    ("base", "moved_run", "standing"),
    [
        (replace(run("x 1"), trace=replace(TRACE, modules=())), run("x 1"), Standing.NO_MUJOCO),
        (run("x 1", is_perturbed=False), run("x 1", is_perturbed=False), Standing.NOT_MOVED),
        (run("x 2"), run("x 1"), Standing.DRIFTED),
        (replace(run(""), outcome=Outcome.FAILED, status=1), run("x 1"), Standing.DRIFTED),
        (run("x 1"), replace(run("x 1"), outcome=Outcome.TIMEOUT), Standing.FAILED),
        (run("x 1"), replace(run("x 1"), outcome=Outcome.FAILED, status=1), Standing.FAILED),
    ],
)
def test_reasons_why_sensitivity_is_not_measured(
    base: ScriptRun, moved_run: ScriptRun, standing: Standing
) -> None:
    sample_course = course(document("", "content/lessons/1.1-a.md"))
    block = recording("x 1")
    result = sensitivity(sample_course, "examples/a.py", "1.1", [block], base, [moved_run] * 4)
    assert result == Sensitivity("examples/a.py", "1.1", standing)
    if standing not in (Standing.FAILED, Standing.NOT_MOVED):
        assert not is_worth_moving(sample_course, [block], base)


# --- warnings


@pytest.mark.parametrize(
    ("comparison", "recorded", "moved_output", "compared"),
    [
        (EXACT, "1.2345", "1.2346", True),
        (DIGITS, "1.2345", "1.2346", True),
        (tolerance("1e-3"), "1.2345", "1.2346", False),
        (tolerance("1e-6"), "1.2345", "1.2346", True),
        (tolerance("0", "1e-12"), "3e-13", "-2e-13", False),
    ],
)
def test_warnings_only_where_the_change_would_be_drift(
    comparison: Comparison, recorded: str, moved_output: str, compared: bool
) -> None:
    result = measure(recorded, moved_output, comparison=comparison)
    assert [doubt.compared for doubt in result.doubts] == [compared]
    assert len(warnings(result)) == int(compared)


def test_a_number_that_moves_no_further_than_the_states_is_no_noise() -> None:
    assert warnings(measure("3.000000000000", "3.000000000003")) == []
    assert warnings(measure("3.000000000000", "3.000000000300")) != []
    assert warnings(measure("2.9999999999999654", "2.9999999999970046")) != []
