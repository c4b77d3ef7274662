"""Sweeps: a model with its parameters at other values, against what mechanics says of it."""

from __future__ import annotations

import math

import mujoco
import pytest
from msgspec.structs import replace

from mjbench.declarations import BenchTable
from mjbench.reports import Interval
from mjbench.reports.records import scene_departures
from mjbench.reports.scene_report import SweepReport, SweepRow
from mjbench.scene import SceneError, scenes
from mjbench.sweep import DrawnModel, drawn_models, measure_sweep
from mjbench.work_precision import measure_scenario
from samples.reports import scene
from samples.surveys import parse_declared

pytestmark = pytest.mark.long

BALL = """\
<mujoco>
  <option timestep="0.0005" gravity="0 0 0"><flag refsafe="disable"/></option>
  <default><geom condim="1" solimp="0.9999 0.9999 0.001"/></default>
  <worldbody>
    <geom name="wall" type="plane" size="1 1 1" solref="-10000 0"/>
    <body name="ball" pos="0 0 0.3">
      <joint name="rail" type="slide" axis="0 0 1"/>
      <geom name="ball" size="0.1" mass="1" solref="-10000 0"/>
    </body>
  </worldbody>
</mujoco>
"""
TOML = """\
[[scenario]]
name = "hit"
qvel = [-1]
duration = 0.4
sample = 0.02
measure = "body:ball"
"""


def run_sweep(
    lines: str, mjcf: str = BALL, *, toml: str = TOML, timed: bool = False
) -> SweepReport:
    text = f'{toml}\n[[sweep]]\nname = "s"\n{lines}\n'
    declarations = parse_declared(text)
    (scene,) = scenes(mujoco.MjModel.from_xml_string(mjcf), declarations)
    ticks = iter(range(0, 10**12, 2_000_000))
    clock = (lambda: next(ticks)) if timed else None
    spec = mujoco.MjSpec.from_string(mjcf)
    return measure_sweep(spec, scene, declarations.sweeps[0], clock, quick=True)


def test_a_spring_gives_back_what_it_takes_and_a_damper_does_not() -> None:
    """Depth v √(m/k), and restitution exp(-πζ/√(1-ζ²)), where ζ = b / (2 √k)."""
    report = run_sweep('vary = { "geom.solref" = [[-10000, 0], [-40000, 0], [-10000, -40]] }')
    undamped, stiffer, damped = report.rows
    assert [row.own for row in report.rows] == [True, False, False]
    assert undamped.restitution == pytest.approx(1, rel=0.02)
    assert undamped.penetration == pytest.approx(0.01, rel=0.03)
    assert stiffer.penetration == pytest.approx(0.005, rel=0.05)
    zeta = 40 / (2 * 100)
    assert damped.restitution is not None
    # A contact that cannot pull lets go a little before the spring is relaxed.
    assert math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)) < damped.restitution < 0.7
    assert undamped.change == 0.0 and damped.change is not None and damped.change > 1


def test_one_element_an_enumeration_and_a_share() -> None:
    report = run_sweep('vary = { "body:ball.pos[2]" = "±10 %", "option.cone" = ["elliptic"] }')
    lighter, heavier, cone = report.rows
    assert [row.value for row in report.rows] == ["-10 %", "+10 %", "elliptic"]
    assert lighter.figure == pytest.approx(0.03, rel=0.05), "a tenth of 0.3 m"
    assert heavier.figure is not None and cone.figure == pytest.approx(0, abs=1e-12)


PENDULUMS = """
<mujoco>
  <option timestep="0.002" integrator="RK4"/>
  <worldbody>
    <body>
      <joint name="upper" axis="0 1 0"/>
      <geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3"/>
      <body pos="0 0 -.3">
        <joint axis="0 1 0"/>
        <geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3"/>
      </body>
    </body>
  </worldbody>
  <keyframe><key qpos="{start} 0"/></keyframe>
</mujoco>
"""


@pytest.mark.parametrize(("start", "is_chaotic"), [("3", True), ("0.3", False)])
def test_in_chaos_a_change_has_a_time_and_no_size(start: str, is_chaotic: bool) -> None:
    """Pendulums that turn over forget their beginning; where they swing little, they do not."""
    toml = '[[scenario]]\nname = "swing"\nkeyframe = 0\nduration = 10\nsample = 0.02\n'
    lines = 'vary = { "geom.density" = [1000], "joint:upper.damping" = [1e-3] }\nshow = ["change"]'
    report = run_sweep(lines, PENDULUMS.format(start=start), toml=toml)
    undamped, damped = report.rows
    assert (undamped.change, undamped.parted) == (0.0, None)
    if is_chaotic:
        assert damped.change is None and damped.parted is not None and 0.2 < damped.parted < 9
    else:
        assert damped.parted is None and damped.change is not None and damped.change > 1


def test_a_solver_with_little_time_leaves_more() -> None:
    """Boxes on each other: the residual falls with the iterations, and the tolerance stops it."""
    boxes = "".join(
        f'<body pos="0 0 {0.1 + 0.2 * n}"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>'
        for n in range(3)
    )
    floor = '<option solver="CG"/><worldbody><geom type="plane" size="1 1 1"/>'
    mjcf = f"<mujoco>{floor}{boxes}</worldbody></mujoco>"
    vary = 'vary = { "option.iterations" = [1, 3, 100], "option.tolerance" = [1e-2, 1e-10] }'
    toml = TOML.replace("qvel = [-1]\n", "").replace('measure = "body:ball"\n', "")
    single, three, all_, rough, fine = run_sweep(vary, mjcf, toml=toml).rows
    assert single.residual and three.residual and all_.residual and rough.residual and fine.residual
    assert 2 > single.residual > 10 * three.residual >= 10 * all_.residual
    assert rough.residual > 1e3 * fine.residual
    assert single.iterations == pytest.approx(1, abs=0.01) and single.slip is not None


def test_a_cylinder_that_hops_as_it_rolls_slides_all_the_way() -> None:
    """Down a slope of 0.5 rad, µ = 0.12 < tan(0.5)/3: it slides at g (sin a − 3 µ cos a) t²/2."""
    slope = '<worldbody><geom type="plane" size="9 9 1" friction="0.12" euler="0 0.5 0"/>'
    cylinder = """<body pos="0.04794 0 0.08776" euler="0 0.5 0"><joint type="slide" axis="1 0 0"/>
    <joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
    <geom type="cylinder" size="0.1" fromto="0 -0.1 0 0 0.1 0" friction="0.12"/></body>"""
    toml = TOML.replace("qvel = [-1]\n", "").replace('measure = "body:ball"\n', "")
    vary = 'vary = { "geom.margin" = [0, 0.005], "option.timestep" = [0.002] }'
    option = '<compiler angle="radian"/><option timestep="0.001" cone="elliptic"/>'
    mjcf = f"<mujoco>{option}{slope}{cylinder}</worldbody></mujoco>"
    rows = run_sweep(vary, mjcf, toml=toml).rows
    distance = 9.81 * (math.sin(0.5) - 3 * 0.12 * math.cos(0.5)) * 0.4**2 / 2
    for row in rows:
        assert row.slip == pytest.approx(distance, rel=0.05), row.value


def test_a_number_alone_is_the_first_of_several() -> None:
    """The others are of damping that grows with a power of speed."""
    vary = 'vary = { "joint.damping" = [0.5, 1, [0, 1, 0]] }'
    toml = TOML.replace("0.4", "0.02")
    rows = run_sweep(vary, BALL.replace('name="rail"', 'name="rail" damping="0.5"'), toml=toml).rows
    assert [row.own for row in rows] == [True, False, False] and rows[1].change
    model = draw_models('draw = { "joint.damping" = [1, 2] }')[0].model
    assert model.dof_damping[0] >= 1 and not model.dof_dampingpoly.any()


def test_what_begins_inside_something_goes_through_nothing() -> None:
    vary = 'vary = { "joint.damping" = [0, 1] }'
    column = '<geom name="column" type="capsule" size="0.1" fromto="0 0 -1 0 0 1"/>'
    rows = run_sweep(vary, BALL.replace("<body", f"{column}<body")).rows
    assert [row.status for row in rows] == ["ok", "ok"]


def draw_models(lines: str, mjcf: str = BALL) -> tuple[DrawnModel, ...]:
    (scenario,) = parse_declared(f"{TOML}{lines}\n").scenarios
    return drawn_models(mujoco.MjSpec.from_string(mjcf), scenario)


def test_parameters_are_drawn_from_their_ranges_each_by_itself() -> None:
    pairs = draw_models(
        'draw = { "geom:ball.mass" = [2, 1], "geom:wall.size[0]" = "± 50 %" }\ndraws = 4'
    )
    masses = [float(part.model.body("ball").mass[0]) for part in pairs]
    widths = [float(part.model.geom("wall").size[0]) for part in pairs]
    assert all(1 <= mass <= 2 for mass in masses) and len(set(masses)) == 4
    assert all(0.5 <= width <= 1.5 for width in widths)
    alone = draw_models('draw = { "geom:ball.mass" = [1, 2] }')
    assert [part.text for part in alone] == [f"geom:ball.mass = {mass:g}" for mass in masses[:3]]
    assert pairs[0].text == f"{alone[0].text}, geom:wall.size[0] {100 * (widths[0] - 1):+.4g} %"
    assert draw_models("draws = 4") == ()


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        ('"geom.solrof" = [0, 1]', "the model has no parameter `geom.solrof`"),
        ('"option.timestep" = [0.001, 0.002]', "`option.timestep` is what is compared"),
        ('"geom:ball.size[0]" = [-2, -1]', "with geom:ball.size[0] = -1."),
    ],
)
def test_what_cannot_be_drawn_is_told(draw: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        draw_models(f"draw = {{ {draw} }}")
    assert caught.value.message.startswith(message)
    assert caught.value.place is not None and caught.value.place.keys[:3] == ("scenario", 0, "draw")


def test_a_setting_that_is_lost_with_drawn_parameters_is_told() -> None:
    # Under Euler at 50 ms an oscillator is stable up to 40 rad/s.
    spring = """<mujoco><option timestep="0.05" gravity="0 0 0"/><worldbody><body>
      <joint name="rail" type="slide" stiffness="0"/><geom size=".1" mass="1"/></body>
      </worldbody></mujoco>"""
    toml = """[[scenario]]
name = "push"
qpos = [0.1]
qvel = [1]
duration = 2
sample = 0.2
timesteps = [0.025, 0.05]
draws = 1
"""
    for low, high, outcome in ((100, 900, "errs by "), (2000, 6000, "is lost: ")):
        text = f'{toml}draw = {{ "joint:rail.stiffness" = [{low}, {high}] }}'
        model, declarations = mujoco.MjModel.from_xml_string(spring), parse_declared(text)
        (scene,) = scenes(model, declarations, quick=True)
        models = drawn_models(mujoco.MjSpec.from_string(spring), scene.declaration)
        report = measure_scenario(model, scene, models, quick=True, clock=None)
        assert report.drawn == (models[0].text,)
        words = f"with {models[0].text} (drawn) the scene's own setting "
        assert any(note.startswith(words + outcome) for note in report.notes), (
            outcome,
            report.notes,
        )
        assert report.failures == ()


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ('{ "geom:bell.solref" = [[1, 1]] }', "the model has no parameter `geom:bell.solref`"),
        ('{ "geom.solrof" = [1] }', "the model has no parameter `geom.solrof`"),
        ('{ "option.cone" = ["round"] }', "`option.cone` cannot be `round`"),
        ('{ "geom.solref[7]" = [1] }', "`geom.solref[7]` cannot be `1`"),
        ('{ "geom:ball.size[0]" = [-1] }', "`geom:ball.size[0]` cannot be `-1`: "),
        ('{ "geom:wall.mass" = "±1 %" }', "`geom:wall.mass` is not given in the MJCF"),
        ('{ "option.timestep" = [0.003] }', "the sampling interval (0.02 s) is not a multiple of"),
    ],
)
def test_what_is_no_parameter_is_told(vary: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        run_sweep(f"vary = {vary}")
    assert message in caught.value.message
    assert caught.value.place is not None and caught.value.place.path == "models/a.toml"


def test_costs_are_timed() -> None:
    rows = run_sweep('vary = { "option.timestep" = [0.0005, 0.001] }', timed=True).rows
    assert all(row.cost is not None for row in rows)


def test_a_lost_run_says_why() -> None:
    (row,) = run_sweep('vary = { "option.gravity[2]" = [-1e15] }').rows
    assert row.status != "ok" and row.reasons and row.change is None


def table(*rows: SweepRow, show: tuple[str, ...] = ()) -> SweepReport:
    return SweepReport("soft", "How <soft>", "swing", show, rows)


ROWS = (
    SweepRow("geom.solref[0]", "0.01", own=True, status="ok", penetration=1e-4, slip=0.0),
    SweepRow("geom.solref[0]", "0.1", own=False, status="ok", penetration=1e-2, slip=0.0),
    SweepRow("option.cone", "elliptic", own=False, status="diverged", reasons=("lost",)),
    SweepRow("option.cone", "pyramidal", own=False, status="ok", cost=Interval(2, 1, 3)),
)


def test_a_figure_that_left_its_band_is_told() -> None:
    old, new = table(*ROWS), table(replace(ROWS[0], penetration=2e-4), *ROWS[1:])

    def departures(*sweeps: SweepReport) -> list[tuple[str, str, str]]:
        pair = (replace(scene(), sweeps=(sweep,)) for sweep in sweeps)
        departed = scene_departures(*pair, BenchTable())
        return [(departure.setting, departure.figure, departure.measured) for departure in departed]

    assert departures(old, old) == []
    assert departures(old, new) == [("geom.solref[0] 0.01", "penetration", "0.0002")]
    faster = replace(ROWS[3], cost=None)
    assert departures(old, table(*ROWS[:3], faster)) == []
