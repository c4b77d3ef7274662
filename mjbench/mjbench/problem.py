"""The definition of a hard case: a model, a scenario in it, and the exact motion.

A number that a motion depends on is written twice: in the MJCF and the scenario, and in the formula
or the equations of the first reference. If only one of them is changed, the references disagree,
which is an error.
"""

from __future__ import annotations

import enum
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple
from numpy.typing import NDArray

from mjbench.declarations import is_multiple
from mjbench.loop import Loop
from mjbench.reports.shown_errors import INTEGRATORS

Array: TypeAlias = NDArray[np.float64]

ROOM = 10.0
"""A run is lost beyond so many times the values of small steps: of velocity, or of kinetic energy
on top of the largest energy."""


class Integrator(enum.Enum):
    """MuJoCo's integrators, as the attribute `integrator` of `<option>` names them."""

    EULER = "Euler"
    """Semi-implicit; joint damping is implicit where MuJoCo's `eulerdamp` is on, as it is."""
    EULER_EXPLICIT = "Euler, eulerdamp off"
    """Semi-implicit, with damping taken at the beginning of the step."""
    IMPLICIT = "implicit"
    IMPLICITFAST = "implicitfast"
    RK4 = "RK4"
    DISCRETE = "discrete"


STANDARD: tuple[Integrator, ...] = tuple(map(Integrator, INTEGRATORS))
"""The integrators with a name of their own in MJCF."""


class Inputs(Struct, frozen=True):
    """What acts from outside for a while; what is empty stays as it is."""

    controls: tuple[float, ...] = ()
    """Commands of actuators (nu,)."""
    forces: tuple[float, ...] = ()
    """`xfrc_applied` in a row (6 nbody,): N and Nm in the world's frame."""
    poses: tuple[float, ...] = ()
    """Of mocap bodies in a row (7 nmocap,): m, and quaternions."""

    def give(self, data: Any) -> None:
        """Give them to `mjData`."""
        if self.controls:
            data.ctrl[:] = self.controls
        if self.forces:
            data.xfrc_applied[:] = np.reshape(self.forces, (-1, 6))
        if self.poses:
            table = np.reshape(self.poses, (-1, 7))
            data.mocap_pos[:], data.mocap_quat[:] = table[:, :3], table[:, 3:]


class Scenario(Struct, frozen=True):
    """The initial state, the duration, the inputs, and when the state is sampled."""

    duration: float
    """Seconds; a multiple of `sample`."""
    sample: float
    """Seconds from one sample of the state to the next; every timestep divides it."""
    qpos: tuple[float, ...] = ()
    """Initial positions, as `mjData.qpos`; the model's own where there are none."""
    qvel: tuple[float, ...] = ()
    """Initial velocities, as `mjData.qvel`; zero where there are none."""
    controls: tuple[tuple[float, ...], ...] = ()
    """Commands one after the other, each for `hold` seconds, the last to the end."""
    hold: float = 0.0
    """Seconds, a multiple of `sample`: inputs change on a grid that all timesteps share."""
    act: tuple[float, ...] = ()
    """Initial activations; the model's own where there are none."""
    forces: tuple[tuple[float, ...], ...] = ()
    """As `controls`, of `Inputs.forces`."""
    poses: tuple[tuple[float, ...], ...] = ()
    """As `controls`, of `Inputs.poses`."""
    keyframe: int = -1
    """The keyframe of the model in which it begins, by number; -1: in none."""
    loop: Loop | None = None
    """The controller that commands it, in place of `controls`."""

    @property
    def times(self) -> Array:
        """When the state is sampled, (n,) s: `sample`, 2 `sample`, …, `duration`."""
        count = whole_number(self.duration, self.sample, "the duration", "the sampling interval")
        return np.asarray(np.arange(1, count + 1) * (self.duration / count), dtype=np.float64)

    def steps(self, timestep: float) -> int:
        """The number of timesteps (s) in a sample; a `ValueError` where it is no whole number."""
        return whole_number(self.sample, timestep, "the sampling interval", "the timestep")

    def holds(self, end: float | None = None) -> list[tuple[float, float, Inputs]]:
        """The intervals in which inputs hold, to `end` (s) or the last: begin, end and inputs.

        There is one without inputs.
        """
        end = self.duration if end is None else end
        tables = self.controls, self.forces, self.poses
        rows = list(itertools.zip_longest(*tables)) or [((), (), ())]
        begins = [index * self.hold for index in range(len(rows))]
        return [
            (begin, min(until, end), Inputs(*(part or () for part in row)))
            for begin, until, row in zip(begins, (*begins[1:], end), rows, strict=True)
            if begin < end
        ]

    def inputs(self, timestep: float) -> Iterator[Inputs]:
        """The inputs of each step, for a timestep (s); for `sample`, those of each sample."""
        for begin, end, inputs in self.holds():
            yield from itertools.repeat(inputs, round((end - begin) / timestep))


def whole_number(length: float, part: float, length_name: str, part_name: str) -> int:
    """How many times `part` goes into `length`; a `ValueError` if an end would not be reached."""
    if not is_multiple(length, part):
        message = f"{length_name} ({length:g} s) is not a multiple of {part_name} ({part:g} s)"
        raise ValueError(message)
    return round(length / part)


class Motion(Struct, frozen=True):
    """States at n times, with attitudes apart from positions: their errors have other orders."""

    times: Array
    """(n,) s."""
    position: Array
    """(n, p) m or rad: coordinates of slides, hinges and places of free bodies, in `qpos` order."""
    attitude: Array
    """(n, a, 4): unit quaternions of ball joints and free bodies, body to world."""
    velocity: Array
    """(n, v) m/s or rad/s, as `qvel`."""


class Sizes(Struct, frozen=True):
    """A size for each of the parts of a motion."""

    position: float
    """m or rad."""
    attitude: float
    """rad."""
    velocity: float
    """m/s or rad/s."""

    def at_least(self, sizes: Sizes) -> Sizes:
        """The larger size of each part."""
        return Sizes(*map(max, astuple(self), astuple(sizes)))

    @property
    def place(self) -> float:
        """The larger size of positions and attitudes."""
        return max(self.position, self.attitude)

    @property
    def largest(self) -> float:
        """The largest size of all parts."""
        return max(self.position, self.attitude, self.velocity)


ROUNDING = Sizes(1e-14, 1e-14, 1e-14)
"""No motion in double precision is known better, in rad and relative to sizes of 1."""


class Solution(Protocol):
    """A motion by a formula or by equations: a frozen struct of the numbers that it depends on."""

    def motion(self, times: Array) -> Motion:
        """The motion at rising times (n,) s."""


class Reference(Struct, frozen=True):
    """The exact motion of a hard case."""

    kind: Literal["closed", "ode"]
    """A closed form, or equations of motion that are integrated."""
    source: str
    """Where it comes from."""
    solution: Solution


class SecondReference(Struct, frozen=True):
    """The same motion from the numbers of the model and the scenario, by independent code.

    The distance of both references says how well the motion is known.
    """

    source: str
    motion: Callable[[str, Scenario, Array], Motion]
    """MJCF, a scenario and rising times (n,) s → the motion."""


class Limit(Struct, frozen=True):
    """The largest stable timestep of an integrator in theory."""

    timestep: float
    """Seconds; infinite where every timestep is stable, 0 where none is."""
    source: str


class ScalarCheck(Struct, frozen=True):
    """A quantity of a hard case that can be measured, and compared with theory if theory has it."""

    name: str
    unit: str
    exact: float | Callable[[Integrator], float] | None
    """Its value in theory, perhaps for an integrator; `None` where theory does not give it."""
    measure: Callable[[Integrator], float | Sequence[float]]
    """Several numbers are the values of an ensemble."""
    source: str
    integrators: tuple[Integrator, ...] = STANDARD
    precision: float = float("inf")
    """How far a measurement may be from theory: beyond it one of them is wrong."""
    precise: tuple[Integrator, ...] = STANDARD
    """The integrators to which that applies."""

    def expected(self, integrator: Integrator) -> float | None:
        """Its value in theory for an integrator."""
        return self.exact(integrator) if callable(self.exact) else self.exact


class Setup(Struct, frozen=True, kw_only=True):
    """What a run needs beside the model: the scenario, and bounds of the states."""

    scenario: Scenario
    position_bound: float = float("inf")
    """Largest |qpos| of a run that is not lost, m or rad."""
    velocity_bound: float = float("inf")
    """Largest |qvel| of a run that is not lost, m/s or rad/s."""
    energy_bound: float = float("inf")
    """Most potential and kinetic energy of a run that is not lost, J; infinite where something
    drives the motion."""
    sunk_bound: float = 1.0
    """How deep bodies may lie in each other before it is watched whether they go through, relative
    to the half thickness of the thinner one: more than 1 where they are that soft in small steps
    too."""
    passing: frozenset[tuple[int, int]] = frozenset()
    """Pairs of geoms that go through each other in small steps too."""


class Problem(Setup, frozen=True, kw_only=True):
    """A hard case."""

    name: str
    """As the command line takes it, such as `tumbling-box`."""
    title: str
    case: int
    """Its number on the list of hard cases."""
    mjcf: str
    """Minimal, without timestep and integrator."""
    reference: Reference
    second: SecondReference | None = None
    """`None`: MuJoCo's accelerations, integrated."""
    precision: Sizes = Sizes(1e-10, 1e-10, 1e-10)
    """The largest allowed difference of both references: beyond it one of them is wrong."""
    timesteps: tuple[float, ...] = ()
    """The ladder of timesteps for work against precision, s, falling."""
    checks: tuple[ScalarCheck, ...] = ()
    limit: Callable[[Integrator], Limit | None] | None = None
    """Theory of the largest stable timestep; `None` where there is none to be had."""
    growth: Callable[[Integrator, float], float] | None = None
    """The factor by which a step of that timestep (s) multiplies what grows first, to hold `limit`
    against; `None`: by the step, linearized at rest."""
    search: tuple[float, float] | None = None
    """Timesteps (s) between which the largest stable one is looked for."""
    span: float = 0.0
    """Simulated time after which an unstable run has grown, s: the same for all timesteps."""
    room: float = ROOM
    """By how many times the largest kinetic energy of the motion a run's energy may rise, where
    nothing drives it."""
    smooth: bool = True
    """Whether errors follow a power of the timestep: not with contact, nor where the model's own
    error remains."""
    energy_conserved: bool = False
    """Whether potential and kinetic energy together do not change."""
    momentum_conserved: bool = False
    """Whether the angular momentum about the centre of mass does not change."""
    note: str = ""
    """A remark for reading the figures."""


NO_CONTACT = '<flag contact="disable"/>'
NO_GRAVITY = 'gravity="0 0 0"'


def model_text(world: str, option: str = "", inner: str = "", rest: str = "") -> str:
    """MJCF without timestep and integrator: what is in the world, of `option`, and the rest."""
    return (
        f"<mujoco>\n  <option {option}>{inner}</option>\n"
        f"  <worldbody>\n{world}\n  </worldbody>\n{rest}</mujoco>\n"
    )


def divisions(sample: float, *parts: int) -> tuple[float, ...]:
    """Timesteps that divide a sample, s."""
    return tuple(sample / n for n in parts)


def motion_without_attitude(times: Array, position: Array, velocity: Array) -> Motion:
    """A motion of slides and hinges, with positions (n, p) and velocities (n, v)."""
    return Motion(times, position, np.empty((len(times), 0, 4)), velocity)


def turning_at_rest(times: Array, attitude: Array, omega: Array) -> Motion:
    """A motion of a free body whose centre rests: attitude (n, 4) and rad/s (n, 3)."""
    still = np.zeros((len(times), 3))
    return Motion(times, still, attitude[:, None], np.concatenate([still, omega], axis=1))
