"""Native MuJoCo compared with the browser's engine: whatever differs is found.

`tests/site/test_parity.py` has models that use much of the engine and move alike in both.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from support.fixture_cases import fixture_text
from support.lab_values import BALL, Bench, make_lab
from support.model_files import TETRAHEDRON

pytestmark = pytest.mark.engine

HEAP = fixture_text("documents/heap.xml")
SLIDING = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .3">
<joint name="j" {}/><geom size=".1"/></body></worldbody><actuator>{}</actuator></mujoco>"""


@pytest.fixture(scope="module")
def recorded(bench: Bench) -> dict[str, Any]:
    """A run that native MuJoCo repeats to the last bit."""
    controller = "data.ctrl[0] = 0.1 * sim.time; if (ctx.n++ === 100) data.qvel[1] += 0.1"
    setup, xml = "ctx.n = 0", HEAP.format("RK4")
    lab = make_lab(xml=xml, setup=setup, controller=controller, verify={"seconds": 1})
    comparison = bench.parity(lab)
    run = comparison["run"]
    assert run["complete"] and not run["modelChanged"]
    assert (comparison["first"], comparison["relative"]) == (None, 0)
    assert (run["steps"], comparison["timestep"]) == (500, 0.002)
    return comparison


def test_only_what_slides_has_no_right_to_differ(bench: Bench) -> None:
    slide, filtered = 'type="slide"', 'dyntype="filterexact" dynprm="1"'
    for joint, actuator, exact in (
        (slide, "", True),
        (slide, '<general joint="j"/>', True),
        (slide, '<general joint="j" dyntype="integrator"/>', True),
        (slide, f'<general joint="j" {filtered}/>', False),
        ('type="hinge"', "", False),
    ):
        lab = make_lab(xml=SLIDING.format(joint, actuator), verify={"seconds": 0.1})
        comparison = bench.parity(lab)
        assert (comparison["exact"], comparison["first"] is None or not exact) == (exact, True)


def test_what_the_lab_changed_in_the_model_is_changed_natively_too(bench: Bench) -> None:
    slider = {"min": 0.001, "max": 9}
    integrators = {"type": "select", "options": [["Euler", 0]], "set": "model.opt.integrator"}
    lab = make_lab(
        xml=HEAP.format("RK4"),
        setup="data.qvel[0] = 2; data.qpos[0] = -1; data.time = 3",
        controls=[
            {**slider, "label": "dt", "value": 0.004, "set": "model.opt.timestep"},
            {**slider, "label": "mass", "value": 3, "set": "model.body_mass[1]"},
            {**integrators, "label": "integrator"},
        ],
        verify={"seconds": 1},
    )
    comparison = bench.parity(lab)
    assert comparison["run"]["mjb"] is not None
    assert (comparison["timestep"], comparison["run"]["steps"]) == (0.004, 250)
    assert comparison["relative"] <= 1e-9, comparison["first"]  # things turn, by sines


def test_model_that_does_not_move_is_the_same(bench: Bench) -> None:
    xml = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    comparison = bench.parity(make_lab(xml=xml, verify={"seconds": 0.1}))
    assert (comparison["first"], comparison["relative"], comparison["run"]["width"]) == (None, 0, 0)


# --- a difference is found


def numbers(packed: dict[str, str], dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(packed["data"]), dtype).copy()


def packed(array: np.ndarray, like: dict[str, str]) -> dict[str, str]:
    return {**like, "data": base64.b64encode(array.tobytes()).decode()}


def alter(run: dict[str, Any], step: int, i: int, change: Callable[[float], float]) -> Any:
    """Change a number of the browser's engine at this step, from 1."""
    states = numbers(run["states"], "<f8").reshape(-1, run["width"])
    sums = numbers(run["checksums"], "<u4")
    states[step - 1, i] = change(states[step - 1, i])
    sums[step - 1] = zlib.crc32(states[step - 1].tobytes())
    return {
        **run,
        "states": packed(states.ravel(), run["states"]),
        "checksums": packed(sums, run["checksums"]),
    }


def test_difference_is_found_where_it_begins_with_its_size(
    bench: Bench, recorded: dict[str, Any]
) -> None:
    """A size is part of the largest number, which is a few."""
    for step, change, low, high in (
        (1, lambda x: x + 1e-3, 5e-5, 1e-3),
        (250, lambda x: x + 1e-12, 5e-14, 1e-12),
        (500, lambda x: x + 1e-3, 5e-5, 1e-3),
        (77, lambda x: np.nextafter(x, 9), 5e-324, 1e-15),
        (9, lambda _: math.nan, 1e300, 1e300),
        (9, lambda _: math.inf, 1e300, 1e300),
    ):
        comparison = bench.native.parity(
            recorded["mjb"], alter(recorded["run"], step, 0, change), 500
        )
        assert comparison["first"] == step
        assert low <= comparison["relative"] <= high
    first_state = numbers(recorded["run"]["states"], "<f8")[: recorded["run"]["width"]]
    zero = first_state.tolist().index(0.0)
    signed = alter(recorded["run"], 1, zero, lambda x: -x)
    comparison = bench.native.parity(recorded["mjb"], signed, 500)
    assert (comparison["first"], comparison["relative"]) == (1, 0), "the sign of a zero has no size"


def test_difference_after_the_horizon_has_no_size_and_one_state_at_least_is_compared(
    bench: Bench, recorded: dict[str, Any]
) -> None:
    run = alter(recorded["run"], 300, 0, lambda x: x + 1.0)
    after, at = (bench.native.parity(recorded["mjb"], run, horizon) for horizon in (299, 300))
    assert (after["first"], after["relative"]) == (300, 0) and at["relative"] > 0.1
    run = alter(recorded["run"], 100, 0, lambda x: x + 1.0)
    states = numbers(run["states"], "<f8").reshape(-1, run["width"])[99::100]
    seldom = {**run, "stride": 100, "states": packed(states.ravel(), run["states"])}
    assert bench.native.parity(recorded["mjb"], seldom, 10)["relative"] > 0.1


def test_another_start_write_or_model_is_found(bench: Bench, recorded: dict[str, Any]) -> None:
    run = recorded["run"]
    start = numbers(run["start"], "<f8")
    start[3] += 1e-6
    values = numbers(run["writes"]["values"], "<f8")
    values[200] += 1e-6
    writes = {**run["writes"], "values": packed(values, run["writes"]["values"])}
    (step,) = numbers(run["writes"]["steps"], "<i4")[200:201]
    euler_model = base64.b64encode(bench.native.save("models/x.xml", HEAP.format("Euler"))).decode()
    for change, first in (
        ({"start": packed(start, run["start"])}, 1),
        ({"writes": writes}, step + 1),
        ({"mjb": {"type": "u8", "data": euler_model}}, 1),
    ):
        assert bench.native.parity(recorded["mjb"], {**run, **change}, 500)["first"] == first


# --- models and limits


def test_model_is_saved_to_the_same_bytes_wherever_the_course_lies(tmp_path: Path) -> None:
    xml = """<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody>
      <geom type="mesh" mesh="m"/><include file="part.xml"/></worldbody></mujoco>"""
    files = set()
    for name in ("a", "a much longer näme"):
        (tmp_path / name / "models").mkdir(parents=True)
        (tmp_path / name / "models/m.obj").write_text(TETRAHEDRON)
        (tmp_path / name / "models/part.xml").write_text("<mujoco><geom size='1'/></mujoco>")
        with NativeEngine(tmp_path / name) as native:
            files |= {native.save(f"models/{file}.xml", xml) for file in ("x", ".lab")}
    assert len(files) == 1


def test_request_after_one_that_fails_or_takes_too_long_is_answered(
    recorded: dict[str, Any], tmp_path: Path
) -> None:
    sums = packed(np.zeros(1_000_000, "<u4"), recorded["run"]["checksums"])
    endless = {**recorded["run"], "steps": 1_000_000, "checksums": sums}
    with NativeEngine(tmp_path, seconds=0.5) as native:
        with pytest.raises(NativeError, match=r"^says: .*unrecognized element"):
            native.save("models/x.xml", "<mujoco><nonsense/></mujoco>")
        with pytest.raises(NativeError, match=r"^says: "):
            native.parity(b"no model", {"mjb": None, "steps": 0}, 1)
        with pytest.raises(NativeError, match=r"^took longer than 0.5 s$"):
            native.parity(recorded["mjb"], endless, 1)
        assert native.save("models/x.xml", BALL)
