"""Every part may fail alone, and what is known when the user stops is reported."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import pytest

from mjbench.loop import step, time_left, time_limit
from mjbench.parts import LATE, STOPPED, Parts
from mjbench.scene import SceneError, scenes
from mjbench.work_precision import StoppedError, measure_scenario
from samples.surveys import parse_declared


def test_a_part_that_fails_is_told_with_its_place_and_takes_no_other_with_it() -> None:
    parts = Parts()
    assert parts.run("a division", lambda: 1 / 0, None) is None
    assert parts.run("a sum", lambda: 1 + 1, 0) == 2

    def results() -> Iterator[int]:
        yield from (1, 2)
        raise ValueError("no  more")

    assert parts.collect("some", results()) == [1, 2]
    division, some = parts.failures
    assert division.part == "a division"
    assert division.reason.startswith("ZeroDivisionError: division by zero (test_parts.py:")
    assert some.reason.startswith("ValueError: no more (")
    with pytest.raises(SceneError):  # an author's mistake ends the whole
        parts.collect("a scenario", iter_error())


def iter_error() -> Iterator[int]:
    raise SceneError("it does not fit")
    yield 1


def test_what_has_not_begun_when_the_user_stops_is_skipped() -> None:
    parts = Parts()

    def stop() -> None:
        raise KeyboardInterrupt

    parts.run("first", stop, None)
    assert parts.run("second", lambda: 1, 0) == 0
    assert [(f.part, f.reason) for f in parts.failures] == [
        ("first", STOPPED),
        ("second", STOPPED),
    ]


def test_a_part_whose_share_of_the_time_is_over_leaves_the_rest_to_others() -> None:
    model = mujoco.MjModel.from_xml_string(SPRING)
    data = mujoco.MjData(model)

    def results() -> Iterator[float]:
        while True:
            step(model, data, 1)
            yield data.time

    with time_limit(3600):
        parts = Parts()
        assert parts.collect("what never ends", results(), share=0) == []
        assert parts.run("the next", lambda: next(results()), 0.0) == pytest.approx(0.01)
        with time_limit(7200):
            assert time_left() < 3601, "an outer limit holds too"
    assert [(f.part, f.reason) for f in parts.failures] == [("what never ends", LATE)]


SPRING = """<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody><body>
  <joint type="slide" stiffness="10"/><geom size=".1" mass="1"/></body></worldbody></mujoco>"""
SWING = '[[scenario]]\nname = "swing"\nqpos = [0.1]\nduration = 0.4\nsample = 0.04\n'


@pytest.mark.long
def test_a_measurement_that_is_stopped_has_what_is_known() -> None:
    model = mujoco.MjModel.from_xml_string(SPRING)
    (scene,) = scenes(model, parse_declared(SWING), quick=True)

    def tell(text: str) -> None:
        if text == "swing: theory of stability":
            raise KeyboardInterrupt

    with pytest.raises(StoppedError) as stop:
        measure_scenario(model, scene, quick=True, clock=None, tell=tell)
    report = stop.value.report
    assert report.own_row is not None and report.own_row.seen is not None
    assert report.stable == () and {failure.reason for failure in report.failures} == {STOPPED}
