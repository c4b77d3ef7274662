"""The browser's engine and native MuJoCo make the same steps, to the last bit where they can.

Models that use much of the engine run through a lab's trial in V8; native MuJoCo repeats each run
from what the trial recorded, as coursebuild does for every lab.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine
from support.fixture_cases import fixture_tables

pytestmark = pytest.mark.engine

STACK = "".join(
    f'<body pos="0 {0.01 * i} {0.11 + 0.22 * i}" euler="0 0 {20 * i}"><freejoint/>'
    '<geom type="box" size=".1 .1 .1"/></body>'
    for i in range(4)
)
GROUND = '<geom type="plane" size="3 3 .1"/>'
ARM = """<body pos="0 0 1"><joint name="a" axis="0 1 0"/>
  <geom name="upper" type="capsule" size=".03" fromto="0 0 0 .3 0 0"/>
  <site name="s" pos=".1 0 .05"/>
  <body pos=".3 0 0"><joint name="b" axis="0 1 0" damping=".1"/>
  <geom name="lower" type="capsule" size=".03" fromto="0 0 0 .3 0 0"/><site name="e" pos=".3 0 0"/>
  </body></body>"""


def model(body: str, option: str = "", extra: str = "") -> str:
    return f"<mujoco><option {option}/><worldbody>{body}</worldbody>{extra}</mujoco>"


PARTS = {"{STACK}": STACK, "{GROUND}": GROUND, "{ARM}": ARM}
MODELS = fixture_tables("parity")
TUMBLE = MODELS.pop("tumbling")
MODELS |= {
    f"tumbling, {name}": {**TUMBLE, "xml": TUMBLE["xml"].replace("{INTEGRATOR}", name)}
    for name in ("Euler", "RK4", "implicit", "implicitfast", "discrete")
}


@pytest.fixture(scope="module")
def engines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[NativeEngine, LabEngine]]:
    root: Path = tmp_path_factory.mktemp("course")
    with NativeEngine(root) as native, LabEngine() as browser:
        yield native, browser


def lab(setup: str | None, controller: str | None) -> dict[str, Any]:
    """A request for a lab without controls, readouts and plots."""
    lists = ("toggles", "overlays", "controls", "readouts", "plots", "expect")
    empty = ("key", "camera", "forceScale", "stopAt", "trail", "seed")
    code = ["controls: []", "readouts: []", "plots: []", "expect: []"]
    for name, text in (("setup", setup), ("controller", controller)):
        if text is not None:
            code.append(f"{name}: ({{model, data, mj, sim, ctx, lib}}) => {{ {text} }}")
    config = {"id": "x", "autoplay": False} | dict.fromkeys(empty) | {name: [] for name in lists}
    return {"config": config, "code": f"({{{', '.join(code)}}})", "seconds": 1.5}


LIBM = {
    "arm, actuators, tendon, sensors",
    "a controller that moves the state",
    "equality, friction loss, limits, mocap",
}
"""Sines and cosines of joint angles, which two C libraries round differently in the last bit."""


@pytest.mark.parametrize("name", MODELS)
def test_the_same_motion(name: str, engines: tuple[NativeEngine, LabEngine]) -> None:
    native, browser = engines
    xml, setup, controller = (MODELS[name].get(key) for key in ("xml", "setup", "controller"))
    for part, content in PARTS.items():
        xml = xml.replace(part, content)
    mjb = native.save("models/m.xml", xml)
    assert native.save("models/m.xml", xml) == mjb, "the same bytes each time"
    reply = browser.trial(lab(setup, controller), mjb, 60.0)
    # A body that jumps is deep in another for a while, in both.
    assert [failure for failure in reply["failures"] if failure["kind"] != "deep"] == []
    run = reply["main"]["parity"]
    assert run["complete"]
    assert not run["modelChanged"]
    assert run["steps"] >= 300 or "moves the state" in name
    second = round(1 / reply["main"]["timestep"])
    comparison = native.parity(mjb, run, horizon=second if name in LIBM else run["steps"])
    assert comparison["relative"] < 1e-9, json.dumps(comparison)
    if name not in LIBM:
        assert comparison["first"] is None, json.dumps(comparison)


def test_a_difference_is_found(engines: tuple[NativeEngine, LabEngine]) -> None:
    native, browser = engines
    mjb = native.save("models/m.xml", model(GROUND + STACK))
    run = browser.trial(lab(None, None), mjb, 60.0)["main"]["parity"]
    changed_model = native.save("models/m.xml", model(GROUND + STACK, 'gravity="0 0 -9.80665"'))
    comparison = native.parity(changed_model, {**run, "mjb": None}, horizon=run["steps"])
    assert comparison["first"] == 1
    assert comparison["relative"] == 0.0 or comparison["relative"] > 1e-9


def test_a_model_that_no_lab_has_changed_is_not_sent_back(
    engines: tuple[NativeEngine, LabEngine],
) -> None:
    native, browser = engines
    mjb = native.save("models/m.xml", model(ARM, "", ""))
    first = browser.trial(lab(None, None), mjb, 60.0)["main"]["parity"]
    frozen = native.save(
        "models/m.xml",
        model(ARM).replace("<option />", '<option><flag autoreset="disable"/></option>'),
    )
    second = browser.trial(lab(None, None), frozen, 60.0)["main"]["parity"]
    assert [(run["mjb"], run["autoreset"]) for run in (first, second)] == [(None, False)] * 2
    assert native.parity(mjb, first, horizon=500)["relative"] < 1e-9
    heavier = lab("model.body_mass[1] *= 2", None)
    assert browser.trial(heavier, mjb, 60.0)["main"]["parity"]["mjb"] is not None


def test_a_state_that_blows_up_is_the_same_with_and_without_the_reset(
    engines: tuple[NativeEngine, LabEngine],
) -> None:
    """Every lab switches MuJoCo's own reset off; one that switches it on again is repeated so."""
    native, browser = engines
    mjb = native.save("models/m.xml", model(ARM, "", ""))
    blow = "if (ctx.done !== true && sim.time > 0.05) { ctx.done = true; data.qvel[0] = 1e200 }"
    on = "model.opt.disableflags &= ~mj.mjtDisableBit.mjDSBL_AUTORESET.value"
    for setup, autoreset in ((None, False), (on, True)):
        run = browser.trial(lab(setup, blow), mjb, 60.0)["main"]["parity"]
        assert (run["mjb"], run["autoreset"]) == (None, autoreset)
        last = run["steps"]
        assert native.parity(mjb, run, horizon=last)["first"] is None
        other_run = {**run, "autoreset": not autoreset}
        assert native.parity(mjb, other_run, horizon=last)["first"] == last
