"""Native MuJoCo beside the browser's engine: the same bits, and whatever differs is found."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coursebuild.features.lab.engines.native import NativeEngine, NativeError, native_digest
from support.lab_values import BALL, Bench, make_lab, xml_of

pytestmark = pytest.mark.site

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    bench = Bench(tmp_path_factory.mktemp("course"))
    with bench.browser, bench.native:
        yield bench


HEAP = """<mujoco><option timestep="0.002" integrator="{}"/>
<worldbody><geom type="plane" size="2 2 .1"/>
<body pos="0 0 .3"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
<body pos=".05 .02 .6" euler="20 10 5"><freejoint/><geom type="box" size=".1 .08 .06"/></body>
<body pos="-.03 0 .9"><freejoint/><geom type="sphere" size=".07"/></body>
<body pos="0 0 1.2"><freejoint/><geom type="capsule" size=".04 .1"/></body>
<body pos="1 0 .5"><joint name="slide" type="slide" damping=".1"/><geom size=".1"/></body>
</worldbody><actuator><motor joint="slide"/></actuator></mujoco>"""
PENDULUM = """<mujoco><option timestep="0.001" integrator="{}"/>
<worldbody><body><joint name="a" type="hinge" axis="0 1 0" damping=".01"/>
<geom type="capsule" fromto="0 0 0 .3 0 .1" size=".02"/>
<body pos=".3 0 .1"><joint name="b" type="hinge" axis="0 1 0"/><geom type="box" size=".1 .02 .03"
pos=".1 0 0"/></body></body></worldbody></mujoco>"""
SLIDER = {"min": 0.001, "max": 9}
EULER = {"type": "select", "options": [["Euler", 0]]}
INTEGRATORS = ("RK4", "Euler", "implicit", "implicitfast")


class TestParity:
    @pytest.mark.parametrize("integrator", INTEGRATORS)
    def test_contacts_and_a_controller_are_the_same_to_the_last_bit(
        self, bench: Bench, integrator: str
    ) -> None:
        controller = (
            "data.ctrl[0] = 0.3 * (0.5 - sim.time) - 0.1 * data.qvel[24];"
            "data.xfrc_applied[6] = sim.time < 0.2 ? 0.5 : 0;"
            "if (ctx.n++ === 100) data.qvel[1] += 0.1"
        )
        lab = make_lab(
            xml=HEAP.format(integrator), setup="ctx.n = 0", controller=controller,
            verify={"seconds": 1},
        )  # fmt: skip
        found = bench.parity(lab)
        run = found["run"]
        assert run["complete"] and not run["modelChanged"]
        assert len(base64.b64decode(run["writes"]["steps"]["data"])) > 4 * 400
        assert (found["first"], found["relative"]) == (None, 0)
        assert (run["steps"], found["timestep"]) == (500, 0.002)

    @pytest.mark.parametrize("integrator", INTEGRATORS)
    def test_hinges_which_need_sines_stay_close(self, bench: Bench, integrator: str) -> None:
        found = bench.parity(make_lab(xml=PENDULUM.format(integrator), verify={"seconds": 1}))
        assert found["run"]["steps"] == 1000
        assert found["relative"] <= 1e-9

    def test_what_only_slides_has_no_right_to_differ(self, bench: Bench) -> None:
        sliding = (
            '<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .3">'
            '<joint type="slide" axis="0 0 1"/><geom size=".1"/></body></worldbody>{}</mujoco>'
        )
        drive = '<actuator><general joint="j" {}/></actuator>'
        exact = bench.parity(make_lab(xml=sliding.format(""), verify={"seconds": 0.5}))
        assert (exact["exact"], exact["first"]) == (True, None)
        named = sliding.replace('type="slide"', 'name="j" type="slide"')
        for actuator, expected in (("", True), ('dyntype="filterexact" dynprm="1"', False)):
            lab = make_lab(xml=named.format(drive.format(actuator)), verify={"seconds": 0.1})
            assert bench.parity(lab)["exact"] is expected
        turning = make_lab(xml=PENDULUM.format("Euler"), verify={"seconds": 0.1})
        assert bench.parity(turning)["exact"] is False

    def test_what_the_lab_changed_in_the_model_is_changed_natively_too(self, bench: Bench) -> None:
        lab = make_lab(
            xml=HEAP.format("RK4"),
            setup="data.qvel[0] = 2; data.qpos[0] = -1; data.time = 3",
            controls=[
                {**SLIDER, "label": "dt", "value": 0.004, "set": "model.opt.timestep"},
                {**SLIDER, "label": "mass", "value": 3, "set": "model.body_mass[1]"},
                {**EULER, "label": "integrator", "set": "model.opt.integrator"},
            ],
            verify={"seconds": 1},
        )  # fmt: skip
        found = bench.parity(lab)
        assert found["run"]["mjb"] is not None
        assert (found["timestep"], found["run"]["steps"]) == (0.004, 250)
        assert found["relative"] <= 1e-9, found["first"]  # things turn, by sines

    def test_actuators_with_a_state_mocap_bodies_and_equalities(self, bench: Bench) -> None:
        xml = """<mujoco><worldbody>
          <body name="hand" mocap="true" pos="0 0 1"><geom size=".05" contype="0" conaffinity="0"/></body>
          <body name="held" pos="0 0 1"><freejoint/><geom size=".05"/></body>
          <body pos="1 0 0"><joint name="j" type="slide"/><geom size=".1"/></body></worldbody>
          <equality><weld body1="hand" body2="held"/></equality>
          <actuator><general joint="j" dyntype="integrator" gainprm="3"/></actuator></mujoco>"""  # noqa: E501
        controller = (
            "data.mocap_pos[0] = Math.sin(3 * sim.time); data.ctrl[0] = 0.2;"
            "if (sim.time > 0.5) data.eq_active[0] = 0; data.qfrc_applied[2] = 0.1"
        )
        found = bench.parity(make_lab(xml=xml, controller=controller, verify={"seconds": 1}))
        assert found["run"]["width"] == 8 + 7 + 1
        assert found["first"] is None

    def test_a_model_that_does_not_move(self, bench: Bench) -> None:
        xml = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
        found = bench.parity(make_lab(xml=xml, verify={"seconds": 0.1}))
        assert (found["first"], found["relative"], found["run"]["width"]) == (None, 0, 0)

    def test_code_that_only_looks_changes_no_bit(self, bench: Bench) -> None:
        shown = "lib.energy().total + lib.norm(lib.angmom()) + sim.contacts().length"
        lab = make_lab(
            xml=HEAP.format("RK4"), verify={"seconds": 0.5},
            readouts=[{"label": "all", "expr": shown}],
            plots=[{"ylabel": "y", "window": 0.1, "traces": [{"label": "t", "expr": shown}]}],
        )  # fmt: skip
        plain = make_lab(xml=HEAP.format("RK4"), verify={"seconds": 0.5})
        runs = [bench.parity(one)["run"] for one in (lab, plain)]
        assert runs[0]["checksums"] == runs[1]["checksums"]


def numbers(packed: dict[str, str], dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(packed["data"]), dtype).copy()


def packed(array: np.ndarray, like: dict[str, str]) -> dict[str, str]:
    return {**like, "data": base64.b64encode(array.tobytes()).decode()}


@pytest.fixture(scope="module")
def recorded(bench: Bench) -> dict[str, Any]:
    lab = make_lab(xml=HEAP.format("RK4"), controller="data.ctrl[0] = 0.1 * sim.time",
                   verify={"seconds": 1})  # fmt: skip
    return bench.parity(lab)


class TestADifferenceIsFound:
    def altered(self, recorded: dict[str, Any], step: int, change: Any) -> dict[str, Any]:
        """The run as if the browser's engine had come to something else at this step (from 1)."""
        run = json.loads(json.dumps(recorded["run"]))
        states = numbers(run["states"], "<f8").reshape(-1, run["width"])
        sums = numbers(run["checksums"], "<u4")
        change(states[step - 1])
        sums[step - 1] = zlib.crc32(states[step - 1].tobytes())
        return {**run, "states": packed(states.ravel(), run["states"]),
                "checksums": packed(sums, run["checksums"])}  # fmt: skip

    def compared(
        self, bench: Bench, recorded: dict[str, Any], run: dict[str, Any], **how: Any
    ) -> Any:
        return bench.native.parity(recorded["mjb"], run, how.get("horizon", 500))

    @pytest.mark.parametrize("step", [1, 2, 250, 500])
    @pytest.mark.parametrize("size", [1e-3, 1e-12])
    def test_where_and_how_large(
        self, bench: Bench, recorded: dict[str, Any], step: int, size: float
    ) -> None:
        def change(state: np.ndarray) -> None:
            state[0] += size

        found = self.compared(bench, recorded, self.altered(recorded, step, change))
        assert (found["first"], found["at"]) == (step, step)
        assert size / 20 < found["relative"] <= size, "of a largest number of a few"

    def test_the_last_bit(self, bench: Bench, recorded: dict[str, Any]) -> None:
        def change(state: np.ndarray) -> None:
            state[0] = np.nextafter(state[0], 9)

        found = self.compared(bench, recorded, self.altered(recorded, 77, change))
        assert found["first"] == 77
        assert 0 < found["relative"] < 1e-15

    @pytest.mark.parametrize("value", [np.nan, np.inf])
    def test_no_number(self, bench: Bench, recorded: dict[str, Any], value: float) -> None:
        def change(state: np.ndarray) -> None:
            state[3] = value

        found = self.compared(bench, recorded, self.altered(recorded, 9, change))
        assert (found["first"], found["at"], found["relative"]) == (9, 9, 1e300)

    def test_the_sign_of_a_zero_is_a_difference_of_no_size(
        self, bench: Bench, recorded: dict[str, Any]
    ) -> None:
        lab = make_lab(
            verify={"seconds": 0.1},
            xml=BALL.replace("<worldbody>", "<option gravity='0 0 0'/><worldbody>"),
        )
        still = bench.parity(lab)

        def change(state: np.ndarray) -> None:
            state[0] = -0.0

        found = self.compared(bench, still, self.altered(still, 5, change))
        assert (found["first"], found["relative"]) == (5, 0)

    def test_what_comes_after_the_horizon_has_no_size(
        self, bench: Bench, recorded: dict[str, Any]
    ) -> None:
        def change(state: np.ndarray) -> None:
            state[0] += 1.0

        run = self.altered(recorded, 300, change)
        assert self.compared(bench, recorded, run, horizon=299)["relative"] == 0
        assert self.compared(bench, recorded, run, horizon=299)["first"] == 300
        assert self.compared(bench, recorded, run, horizon=300)["relative"] > 0.1

    def test_states_that_are_recorded_seldom_are_compared_at_least_once(
        self, bench: Bench, recorded: dict[str, Any]
    ) -> None:
        def change(state: np.ndarray) -> None:
            state[0] += 1.0

        run = self.altered(recorded, 100, change)
        states = numbers(run["states"], "<f8").reshape(-1, run["width"])[99::100]
        seldom = {**run, "stride": 100, "states": packed(states.ravel(), run["states"])}
        assert self.compared(bench, recorded, seldom, horizon=10)["relative"] > 0.1

    def test_another_start_another_write_another_model(
        self, bench: Bench, recorded: dict[str, Any]
    ) -> None:
        run = recorded["run"]
        start = numbers(run["start"], "<f8")
        start[3] += 1e-6
        other = {**run, "start": packed(start, run["start"])}
        assert self.compared(bench, recorded, other)["first"] == 1
        values = numbers(run["writes"]["values"], "<f8")
        values[200] += 1e-6
        writes = {**run["writes"], "values": packed(values, run["writes"]["values"])}
        (at,) = numbers(run["writes"]["steps"], "<i4")[200:201]
        assert self.compared(bench, recorded, {**run, "writes": writes})["first"] == at + 1
        lighter = bench.native.save("models/x.xml", HEAP.format("Euler"))
        mjb = {"type": "u8", "data": base64.b64encode(lighter).decode()}
        assert self.compared(bench, recorded, {**run, "mjb": mjb})["first"] == 1


class TestSave:
    def test_the_same_bytes_wherever_the_course_lies(self, tmp_path: Path) -> None:
        xml = """<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody>
          <geom type="mesh" mesh="m"/><include file="part.xml"/></worldbody></mujoco>"""
        found = set()
        for name in ("a", "a much longer näme"):
            (tmp_path / name / "models").mkdir(parents=True)
            (tmp_path / name / "models/m.obj").write_text(TETRAHEDRON)
            (tmp_path / name / "models/part.xml").write_text("<mujoco><geom size='1'/></mujoco>")
            with NativeEngine(tmp_path / name) as native:
                found |= {native.save(f"models/{file}.xml", xml) for file in ("x", ".lab")}
        assert len(found) == 1

    def test_a_text_that_does_not_compile(self, bench: Bench) -> None:
        with pytest.raises(NativeError, match=r"^says: .*unrecognized element"):
            bench.native.save("models/x.xml", "<mujoco><nonsense/></mujoco>")
        assert bench.native.save("models/x.xml", BALL)

    def test_a_model_that_is_none(self, bench: Bench) -> None:
        run = {"mjb": None, "steps": 0}
        with pytest.raises((NativeError, KeyError)):
            bench.native.parity(b"no model", run, 1)
        assert bench.native.save("models/x.xml", BALL)


def test_a_run_that_takes_too_long_is_told_and_the_next_request_answered(
    bench: Bench, tmp_path: Path
) -> None:
    lab = make_lab(xml=HEAP.format("RK4"), verify={"seconds": 0.1})
    mjb = bench.native.save("models/x.xml", xml_of(lab))
    run = bench.parity(lab)["run"]
    sums = packed(np.zeros(1_000_000, "<u4"), run["checksums"])
    with NativeEngine(tmp_path, seconds=1.0) as native:
        with pytest.raises(NativeError, match=r"^took longer than 1 s$"):
            native.parity(mjb, {**run, "steps": 1_000_000, "checksums": sums}, 1)
        assert native.save("models/x.xml", BALL)


def test_the_digest_is_of_the_worker() -> None:
    assert len(native_digest()) == 64
