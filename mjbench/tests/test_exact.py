"""A known motion, `NAME.exact.py`: errors refer to it, or it is a mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from mjbench.bench import CannotMeasureError, compile_subject, read_subject, run_scenario
from mjbench.host import LocalHost
from mjbench.reports.scene_report import ScenarioReport

pytestmark = pytest.mark.long

BALL = """\
<mujoco>
  <worldbody>
    <body><joint name="j" type="slide" axis="0 0 1"/><geom size="0.1"/></body>
  </worldbody>
  <sensor><jointpos name="height" joint="j"/></sensor>
</mujoco>
"""
TOML = '[[scenario]]\nname = "up"\nqpos = [1]\nqvel = [3]\nduration = 0.4\nsample = 0.1\n'
TOML += 'measure = "sensor:height"\n'
EXACT = """\
print("reading")


def motion(time, qpos, qvel):
    return qpos + qvel * time - 9.81 / 2 * time**2{velocity}
"""


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path / "ball.xml", BALL)
    return tmp_path


FEW_RUNS = "timesteps = [0.0005]\nsearch = [0.008, 0.02]\n"
"""A motion is checked in steps as short as ever; few settings and timesteps are tried after it."""


def report(folder: Path, exact: str = "", toml: str = TOML) -> ScenarioReport:
    if exact:
        write(folder / "ball.exact.py", exact)
    write(folder / "ball.toml", toml if "timesteps" in toml else toml + FEW_RUNS)
    host = LocalHost(folder, lambda text: None)
    compiled_model = compile_subject(read_subject(folder / "ball.xml"), host, quick=True)
    return run_scenario(compiled_model, 0, host, quick=True, timed=False)


def mistake(folder: Path, exact: str = "", toml: str = TOML) -> CannotMeasureError:
    with pytest.raises(CannotMeasureError) as caught:
        report(folder, exact, toml)
    return caught.value


def test_errors_are_taken_from_the_exact_motion(folder: Path) -> None:
    for velocity in (", qvel - 9.81 * time", ""):
        scenario = report(folder, EXACT.format(velocity=velocity))
        assert (scenario.reference, scenario.source) == ("closed", "ball.exact.py")
        assert scenario.second == "Bulirsch–Stoer over mj_forward" and scenario.floor < 1e-13
        (own_row,) = (row for row in scenario.rows if row.own)
        assert own_row.position is not None
        assert own_row.position[0] == pytest.approx(9.81 * 0.4 * 0.002 / 2)
        assert own_row.figure == pytest.approx(own_row.position)
    with_reference = TOML + 'reference = "ode"\n'
    assert report(folder, EXACT.format(velocity=""), with_reference).reference == "ode"


PENDULUM = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody><body><joint name="j" axis="0 1 0"/>
    <geom size=".01" pos="0 0 -1" mass="1"/><inertial pos="0 0 -1" mass="1" diaginertia="0 0 0"/>
  </body></worldbody>
  <sensor><jointpos name="angle" joint="j"/></sensor>
</mujoco>
"""


def test_quantities_of_theory_are_measured_by_their_formula(folder: Path) -> None:
    """A pendulum let go at 90°: it is down after a quarter of its period, K(1/2)/√g."""
    write(folder / "ball.xml", PENDULUM.replace('"0 0 0"/>', '"1e-9 1e-9 1e-9"/>'))
    start = "qpos = [1.5707963267948966]\nduration = 1\nsample = 0.02\nmeasure = 'sensor:angle'\n"
    toml = f"[[scenario]]\nname = 'swing'\n{start}timesteps = [0.002]\nsearch = [0.01, 0.02]\n"
    quarter = "expected = {{ crossing = {}, largest = 1.5707963267948966 }}\n".format
    scenario = report(folder, toml=toml + quarter(0.5919605))
    figures = {(line.integrator, line.name): line for line in scenario.figures}
    crossing = figures["RK4", "crossing"]
    assert (crossing.unit, crossing.exact) == ("s", 0.5919605)
    assert crossing.measured == pytest.approx(crossing.exact, abs=1e-6)
    euler = figures["Euler", "crossing"].measured
    assert euler is not None and 1e-5 < abs(euler - 0.5919605) < 1e-2
    largest = figures["RK4", "largest"]
    assert (largest.measured, largest.unit) == (1.5707963267948966, "rad"), "where it begins"
    slip = mistake(folder, toml=toml + quarter(0.6038))
    assert slip.message.startswith("the expected crossing, 0.6038, is not this scene's: it is 0.59")
    message = mistake(folder, toml=toml + "expected = { loudest = 1 }\n").message
    assert "loudest" in message


DOUBLE = """\
<mujoco>
  <worldbody><body><joint name="j" axis="0 1 0"/><geom size=".01" pos="0 0 -1" mass="1"/>
    <body pos="0 0 -1"><joint axis="0 1 0"/><geom size=".01" pos="0 0 -1" mass="1"/></body>
  </body></worldbody>
  <sensor><jointpos name="angle" joint="j"/></sensor>
</mujoco>
"""


def test_where_small_steps_do_not_agree_what_is_expected_is_left_open(folder: Path) -> None:
    write(folder / "ball.xml", DOUBLE)
    toml = "[[scenario]]\nname = 'swing'\nqpos = [2, 0.5]\nduration = 9\nmeasure = 'sensor:angle'\n"
    toml += "timesteps = [0.003]\nsample = 0.3\nsearch = [0.1, 0.2]\nexpected = { last = 1.5 }\n"
    (line, *_) = report(folder, toml=toml).figures
    assert line.source.startswith("as declared; small steps tell no more than ")


BOUNCE = """\
<mujoco>
  <option timestep="0.002" cone="elliptic"/>
  <worldbody>
    <geom type="plane" size="5 5 .1" friction="0.5"/>
    <body pos="0 0 .1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
    <geom type="box" size=".1 .1 .1" mass="1" friction="0.5"/></body>
  </worldbody>
</mujoco>
"""
SLIDE = """\
def motion(time, qpos, qvel):
    stop = min(time, qvel[0] / (9.81 * {friction}))
    return [qvel[0] * stop - 9.81 * {friction} / 2 * stop**2, {height}]
"""


def test_an_exact_motion_with_contact_is_what_stiffer_contacts_tend_to(folder: Path) -> None:
    write(folder / "ball.xml", BOUNCE)
    toml = '[[scenario]]\nname = "slide"\nqvel = [1, 0]\nduration = 0.4\nsample = 0.02\n'
    scenario = report(folder, SLIDE.format(friction=0.5, height=0), toml)
    assert scenario.reference == "closed" and scenario.figures == ()
    (own_row,) = (row for row in scenario.rows if row.own)
    assert own_row.seen is not None and own_row.seen > 3 * scenario.least_seen, "resolved"
    toml_with_figures = toml + "expected = { penetration = 1.1e-4 }\nprecision = 5e-5\n"
    scenario = report(folder, SLIDE.format(friction=0.5, height=0), toml_with_figures)
    depths = {line.integrator: (line.measured, line.exact) for line in scenario.figures}
    assert depths["Euler"] == (pytest.approx(2.1e-4, rel=0.2), 1.1e-4)
    for values in ({"friction": 0.6, "height": 0}, {"friction": 0.5, "height": "time"}):
        diagnostic = mistake(folder, SLIDE.format(**values), toml)
        assert "is not this scene's motion" in diagnostic.message, values
        assert "contacts as they are" in diagnostic.help, values


PULLEY = """\
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <body pos="0 0 1"><joint name="a" type="slide" axis="0 0 1"/><geom size=".05" mass="1"
      contype="0" conaffinity="0"/></body>
    <body pos="1 0 1"><joint name="b" type="slide" axis="0 0 1"/><geom size=".05" mass="5"
      contype="0" conaffinity="0"/></body>
  </worldbody>
  <equality><joint joint1="a" joint2="b" polycoef="0 -1 0 0 0" solref=".005 1"/></equality>
</mujoco>
"""
ATWOOD = """\
def motion(time, qpos, qvel):
    fall = {share} * 9.81 * time**2 / 2
    return [fall, -fall], [{share} * 9.81 * time, -{share} * 9.81 * time]
"""


def test_rigid_theory_of_a_soft_equality_is_what_stiffer_ones_tend_to(folder: Path) -> None:
    """Two weights over a pulley, 1 and 5 kg: they go with two thirds of gravity."""
    write(folder / "ball.xml", PULLEY)
    toml = '[[scenario]]\nname = "fall"\nduration = 0.2\nsample = 0.02\ntimesteps = [0.001]\n'
    toml += "search = [0.005, 0.01]\n"
    scenario = report(folder, ATWOOD.format(share="2 / 3"), toml)
    assert scenario.reference == "closed"
    error = mistake(folder, ATWOOD.format(share="0.66"), toml)
    assert "is not this scene's motion" in error.message


ROLL = """\
<mujoco>
  <option timestep="0.002" cone="elliptic"/>
  <default><geom friction="0.8"/></default>
  <worldbody>
    <geom type="plane" size="5 5 .1" euler="0 20 0"/>
    <body euler="0 20 0"><body pos="0 0 .1"><joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/><geom size=".1" mass="1"/>
    </body></body>
  </worldbody>
</mujoco>
"""
ROLLED = """\
from math import radians, sin

A = 5 / 7 * {g} * sin(radians(20))


def motion(time, qpos, qvel):
    return [A * time**2 / 2, 0, A * time**2 / 0.2], [A * time, 0, A * time / 0.1]
"""


def test_an_exact_motion_with_contact_that_is_off_by_a_hundred_thousandth_is_refused(
    folder: Path,
) -> None:
    write(folder / "ball.xml", ROLL)
    toml = '[[scenario]]\nname = "roll"\nduration = 1\nsample = 0.04\n'
    scenario = report(folder, ROLLED.format(g=9.81), toml)
    assert scenario.reference == "closed" and scenario.floor < 1e-5
    diagnostic = mistake(folder, ROLLED.format(g=9.81 * (1 + 1e-5)), toml)
    assert "is not this scene's motion" in diagnostic.message
    assert "4, 8, 16" in diagnostic.help, "where the softness of contacts hides it no longer"


def test_velocities_of_an_exact_motion_with_contact_are_rates_of_its_positions(
    folder: Path,
) -> None:
    """Against an engine whose contacts are soft only places are compared."""
    write(folder / "ball.xml", BOUNCE)
    toml = '[[scenario]]\nname = "slide"\nqvel = [1, 0]\nduration = 0.4\nsample = 0.02\n'
    slide = SLIDE.format(friction=0.5, height=0)[:-1] + ", [{} * (qvel[0] - 4.905 * stop), 0]\n"
    assert report(folder, slide.format(1), toml).reference == "closed"
    diagnostic = mistake(folder, slide.format(0.9), toml)
    assert diagnostic.message.endswith("gives velocities that are not the rates of positions")
    assert diagnostic.help == "number 0 is 0.812 at 0.02 s, where the positions give 0.902"


SOFT = """\
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <default><geom condim="1" solref="-1000 -20" solimp="0.9 0.9 0.001"/></default>
  <worldbody>
    <geom type="plane" size="5 5 .1"/>
    <body pos="0 0 .1"><freejoint/><geom size=".1" mass="1"/></body>
  </worldbody>
</mujoco>
"""
REBOUND = """\
from math import atan, cos, exp, pi, sin


def motion(time, qpos, qvel):
    t = min(time, (pi - atan(0.75)) / 30)  # until nothing pushes any more
    z = qvel[2] / 30 * exp(-10 * t) * sin(30 * t)
    v = qvel[2] * exp(-10 * t) * (cos(30 * t) - sin(30 * t) / 3)
    return [0, 0, 0.1 + z + v * (time - t), 1, 0, 0, 0]
"""


def test_an_exact_motion_of_soft_contacts_is_known_as_well_as_the_engine_agrees(
    folder: Path,
) -> None:
    """Stiffer contacts tend to something else, which says nothing of this motion."""
    write(folder / "ball.xml", SOFT)
    toml = '[[scenario]]\nname = "hit"\nqvel = [0, 0, -0.5, 0, 0, 0]\nduration = 0.2\n'
    scenario = report(folder, REBOUND, toml + "sample = 0.02\n")
    assert scenario.reference == "closed" and scenario.floor < 1e-4
    own_row = next(row for row in scenario.rows if row.own)
    assert own_row.position is not None and own_row.position[0] > 2 * scenario.floor


def test_what_is_not_exact_or_no_motion_is_a_mistake(folder: Path) -> None:
    cases = {
        EXACT.format(velocity="").replace("/ 2", "/ 3"): "is not this scene's motion",
        "def motion(time, qpos, qvel):\n    return [1, 2]\n": "gives numbers of coordinates that",
        "x = 1\n": "gives no motion: KeyError: 'motion'",
        "def motion(time, qpos, qvel):\n    return qpos * float('nan')\n": "or not a number",
        "import sys\n\nsys.exit()\n": "gives no motion: it exits",
        "def motion(time, qpos, qvel):\n    return [1] * int(1 + time * 9)\n": "coordinates change",
    }
    for text, message in cases.items():
        diagnostic = mistake(folder, text)
        assert message in diagnostic.message, text
        assert diagnostic.place.path == "ball.exact.py", text


def test_what_was_measured_depends_on_it(folder: Path) -> None:
    digests = {read_subject(folder / "ball.xml").digest}
    for exact in (EXACT, EXACT + "\n"):
        write(folder / "ball.exact.py", exact)
        digests.add(read_subject(folder / "ball.xml").digest)
    assert len(digests) == 3
