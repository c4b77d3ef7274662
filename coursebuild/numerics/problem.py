"""What a hard case is: a model, what happens in it, and what exactly would happen.

Entry points: `Problem`, `Scenario`, `Reference`, `SecondReference`, `Motion`, `ScalarCheck`,
`Integrator`; `Setup`, what a run needs beside the model.

A number that a motion depends on is written twice: in the MJCF and the scenario, and in the formula
or the equations that the first reference goes by. Whoever changes one of them alone is told.
"""

from __future__ import annotations

import enum
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Literal, Protocol, TypeAlias

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple
from numpy.typing import NDArray

from coursebuild.core.model.scenarios import is_multiple

Array: TypeAlias = NDArray[np.float64]

ROOM = 10.0
"""So many times what is seen in small steps is called impossible: velocities, or the kinetic energy
that comes on top of all energy."""


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


STANDARD: tuple[Integrator, ...] = tuple(
    integrator for integrator in Integrator if integrator is not Integrator.EULER_EXPLICIT
)
"""Those with a name of their own in MJCF."""


class Scenario(Struct, frozen=True):
    """What happens: where it begins, how long it takes, what is commanded, when it is looked at."""

    duration: float
    """Seconds; a multiple of `sample`."""
    sample: float
    """Seconds from one look at the state to the next; every timestep divides it."""
    qpos: tuple[float, ...] = ()
    """Initial positions, as `mjData.qpos`; the model's own where there are none."""
    qvel: tuple[float, ...] = ()
    """Initial velocities, as `mjData.qvel`; zero where there are none."""
    controls: tuple[tuple[float, ...], ...] = ()
    """Commands one after the other, each for `hold` seconds, the last to the end."""
    hold: float = 0.0
    """Seconds, a multiple of `sample`: commands change on a grid that all timesteps share."""
    keyframe: int = -1
    """The keyframe of the model in which it begins, by number; -1: in none."""

    @property
    def times(self) -> Array:
        """When the state is looked at, (n,) s: `sample`, 2 `sample`, …, `duration`."""
        count = whole_number(self.duration, self.sample, "the duration", "the sampling interval")
        return np.asarray(np.arange(1, count + 1) * (self.duration / count), dtype=np.float64)

    def steps(self, timestep: float) -> int:
        """How many timesteps (s) go from one look to the next.

        Raises:
            ValueError: no whole number.
        """
        return whole_number(self.sample, timestep, "the sampling interval", "the timestep")

    def command(self, look: int) -> tuple[float, ...]:
        """What is commanded between a look (from 0) and the one before; empty where nothing is.

        Raises:
            ValueError: the hold is no multiple of `sample`.
        """
        if not self.controls:
            return ()
        looks = 1
        if self.hold:
            looks = whole_number(self.hold, self.sample, "the hold", "the sampling interval")
        return self.controls[min(look // looks, len(self.controls) - 1)]

    def commands(self, timestep: float) -> Iterator[tuple[float, ...]]:
        """What is commanded in each step (s), one after the other."""
        for look in range(len(self.times)):
            yield from itertools.repeat(self.command(look), self.steps(timestep))


def whole_number(length: float, part: float, length_name: str, part_name: str) -> int:
    """How many times `part` goes into `length`.

    Raises:
        ValueError: not a whole number of times, so that an end would not be reached.
    """
    if not is_multiple(length, part):
        message = f"{length_name} ({length:g} s) is no multiple of {part_name} ({part:g} s)"
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
        """Of each part the larger one."""
        return Sizes(*map(max, astuple(self), astuple(sizes)))

    @property
    def place(self) -> float:
        """Of positions and attitudes together."""
        return max(self.position, self.attitude)

    @property
    def largest(self) -> float:
        """Of all of them."""
        return max(self.position, self.attitude, self.velocity)


ROUNDING = Sizes(1e-14, 1e-14, 1e-14)
"""No motion in double precision is known better, in rad and relative to sizes of 1."""


class Solution(Protocol):
    """A motion by a formula or by equations: a frozen struct of the numbers that it depends on."""

    def motion(self, times: Array) -> Motion:
        """The motion at rising times (n,) s."""


class Reference(Struct, frozen=True):
    """What exactly happens."""

    kind: Literal["closed", "ode"]
    """A closed form, or equations of motion that are integrated."""
    source: str
    """Where it comes from."""
    solution: Solution


class SecondReference(Struct, frozen=True):
    """The same from the numbers of the model and the scenario, with none of the first one's code.

    How far the two are apart is how well the motion is known.
    """

    source: str
    motion: Callable[[str, Scenario, Array], Motion]
    """MJCF, a scenario and rising times (n,) s → the motion."""


class Limit(Struct, frozen=True):
    """What theory says of the largest stable timestep of an integrator."""

    timestep: float
    """Seconds; infinite where every timestep is stable, 0 where none is."""
    source: str


class ScalarCheck(Struct, frozen=True):
    """A quantity of a hard case that can be measured, and is known where theory says it."""

    name: str
    unit: str
    exact: float | Callable[[Integrator], float] | None
    """What it is in theory, perhaps for an integrator; `None` where theory does not say it."""
    measure: Callable[[Integrator], float | Sequence[float]]
    """Several numbers are those of an ensemble."""
    source: str
    integrators: tuple[Integrator, ...] = STANDARD

    def expected(self, integrator: Integrator) -> float | None:
        """What it is in theory for an integrator."""
        return self.exact(integrator) if callable(self.exact) else self.exact


class Setup(Struct, frozen=True, kw_only=True):
    """What a run must know beside the model: what happens, and what can be."""

    scenario: Scenario
    position_bound: float = float("inf")
    """Largest |qpos| that can be, in m or rad; what is beyond grows that should not."""
    velocity_bound: float = float("inf")
    """Largest |qvel| that can be, in m/s or rad/s."""
    energy_bound: float = float("inf")
    """Most potential and kinetic energy together that can be, J, where nothing drives the motion;
    infinite where something does."""
    penetration_bound: float = float("inf")
    """Deepest contact that is no fault, m."""


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
    """What the two may differ by, at most: beyond it one of them is wrong."""
    timesteps: tuple[float, ...] = ()
    """The ladder of timesteps for work against precision, s, falling."""
    checks: tuple[ScalarCheck, ...] = ()
    limit: Callable[[Integrator], Limit | None] | None = None
    """Theory of the largest stable timestep; `None` where there is none to be had."""
    search: tuple[float, float] | None = None
    """Timesteps (s) between which the largest stable one is looked for."""
    span: float = 0.0
    """Simulated time after which what grows must have shown itself, s: the same for all
    timesteps."""
    room: float = ROOM
    """How many times the largest kinetic energy of its motion energy may rise by, where nothing
    drives it."""
    smooth: bool = True
    """Whether errors follow a power of the timestep: not with contact, nor where the model's own
    error remains."""
    energy_conserved: bool = False
    """Whether potential and kinetic energy together do not change."""
    momentum_conserved: bool = False
    """Whether the angular momentum about the centre of mass does not change."""
    note: str = ""
    """What to know when reading the figures."""
