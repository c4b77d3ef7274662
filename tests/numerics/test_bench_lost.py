"""Divergence never passes as success when a model is measured; and what is told meanwhile."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest

from coursebuild.numerics.scene import SceneError, scenes
from coursebuild.numerics.work_precision import measure_scenario
from support.bench_runs import measure
from support.surveys import NO_DECLARATIONS

pytestmark = pytest.mark.site

STIFF = """\
<mujoco>
  <option timestep="{step}"/>
  <worldbody>
    <body>
      <joint type="slide" stiffness="{stiffness}"/>
      <geom size="0.1" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <keyframe><key qpos="{start}"/></keyframe>
</mujoco>
"""

FROM_KEYFRAME = '[[scenario]]\nname = "a"\nkeyframe = 0\nreference = "self"\n'
"""The engine is its own reference: integrating the stiff spring takes ten times as long."""


def stiff(step: float, start: float, stiffness: float = 1e5) -> Any:
    text = STIFF.format(step=step, start=start, stiffness=stiffness)
    return mujoco.MjModel.from_xml_string(text)


def test_a_scene_that_blows_up_under_its_own_setting() -> None:
    """Without `autoreset="disable"` such a run ends where it began, with error 0."""
    (report,) = measure(stiff(0.008, 0.01), FROM_KEYFRAME, quick=True)
    (own_row,) = (line for line in report.rows if line.own)
    assert own_row.status == "diverged"
    assert "MuJoCo warned of bad accelerations" in own_row.reasons
    assert (own_row.position, own_row.velocity, own_row.seen) == (None, None, None)
    assert own_row.growth is None or own_row.growth > 1
    assert not report.verdict.on_front
    assert report.verdict.text.startswith(
        "the scene does not run under its own setting, Euler at 8 ms: "
    )
    limits = {line.integrator: line.largest for line in report.stable}
    for name in ("Euler", "implicit", "implicitfast"):
        # Below 2/ω it swings within bounds, but just below with any multiple of its energy.
        assert limits[name] == pytest.approx(2 * (10 / 11) ** 0.5 / 1e5**0.5, rel=0.05)
    assert limits["discrete"] is None


def test_a_scene_that_diverges_at_every_timestep_is_refused() -> None:
    with pytest.raises(SceneError, match=r"it diverges within .* s even at 0\.25 s a step"):
        measure(stiff(1.0, 0.01), quick=True)


def test_times_are_of_the_clock() -> None:
    """A clock that ticks evenly: whatever is timed takes the same, and nothing is uncertain."""
    ticks = iter(range(0, 10**15, 2_000_000))
    model = stiff(0.01, 0.1, 10)
    (line,) = scenes(model, NO_DECLARATIONS, quick=True)
    report = measure_scenario(model, line, quick=True, clock=lambda: next(ticks))
    for line in report.rows:
        assert line.cost is not None and line.seconds is not None and line.realtime is not None
        assert line.cost.low == line.cost.value == line.cost.high > 0
        assert line.seconds.value * line.realtime == pytest.approx(1.0)
    assert [line.cost.value for line in report.rows if line.own and line.cost] == [1.0]
    assert any(line.front for line in report.rows)
