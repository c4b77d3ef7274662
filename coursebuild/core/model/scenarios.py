"""The content of a file `models/NAME.toml`: scenarios of the model, and findings to keep.

What is left out is `None` or empty; measuring fills it in from the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct

from coursebuild.core.model import fields
from coursebuild.core.model.fields import Positive, Slug, describe, matching
from coursebuild.core.text.source import Source, Span

DURATION, MOST_STEPS = 2.0, 20_000
"""The length of a scenario that does not say its own: seconds, and the most timesteps."""


def keyframe_scenarios(keyframes: Sequence[str]) -> tuple[str, ...]:
    """The scenarios of a model that declares none: one for each keyframe, or `start`."""
    names: list[str] = []
    for number, keyframe in enumerate(keyframes):
        name = keyframe if keyframe.strip() else f"keyframe-{number}"
        while not keyframe.strip() and name in keyframes:
            name += "-"
        names.append(name)
    return tuple(names) or ("start",)


def exact_file(model: str) -> str:
    """The file in which a course may give the exact motion of a model."""
    return f"models/{model}.exact.py"


def is_multiple(length: float, part: float) -> bool:
    """Whether `length` is a whole multiple of `part`, up to rounding."""
    count = round(length / part) if length / part < 1e15 else 0
    return count >= 1 and abs(count * part - length) <= 1e-9 * length


class BenchTable(Struct, frozen=True, forbid_unknown_fields=True):
    """The size from which an error is visible, and by how much it may differ."""

    visible: Annotated[float, describe("share of the model's extent", gt=0, le=1)] = 0.01
    visible_angle: Annotated[float, describe("degrees, for attitudes and hinges", gt=0, le=180)] = (
        1.0
    )
    band: Annotated[
        float, describe("share by which an error may differ from the recorded one", gt=0, le=1)
    ] = 0.05
    order_band: Annotated[
        float, describe("by how much a fitted order may differ from the recorded one", gt=0, le=1)
    ] = 0.05


class Measured(Struct, frozen=True):
    """A quantity measured besides coordinates: a position, or the reading of a sensor.

    Recorded reports hold a digest of its `repr`: its name stays.
    """

    kind: Literal["body", "site", "sensor"]
    name: str


Expected: TypeAlias = Literal[
    "restitution", "penetration", "slip", "crossing", "last", "largest", "smallest"
]


class PushTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A force on a body, for a while."""

    body: Annotated[fields.Text, describe("its name")]
    at: Annotated[float, describe("seconds, when it begins", ge=0)]
    duration: Annotated[Positive, describe("seconds")]
    force: Annotated[tuple[float, float, float], describe("N, in the world's frame")] = (0.0,) * 3
    torque: Annotated[tuple[float, float, float], describe("Nm, in the world's frame")] = (0.0,) * 3


Pose: TypeAlias = tuple[float, float, float, float, float, float, float]
_SHARE = r"^±\s*(?!0+(?:\.0+)?\s*%)\d+(?:\.\d+)?\s*%$"
"""How a share is named of the model's own value."""


class ScenarioTable(Struct, frozen=True, forbid_unknown_fields=True):
    """What happens to the model: initial state, duration, commands."""

    name: Annotated[Slug, describe("by which reports call it")]
    title: Annotated[fields.Text | None, describe("shown over its figures")] = None
    keyframe: Annotated[
        Annotated[int, Meta(ge=0)] | fields.Text | None,
        describe("where it begins, by name or by number from 0"),
    ] = None
    qpos: Annotated[
        tuple[float, ...], describe("positions at the beginning, instead of the keyframe's")
    ] = ()
    qvel: Annotated[
        tuple[float, ...], describe("velocities at the beginning, instead of the keyframe's")
    ] = ()
    duration: Annotated[Positive | None, describe("seconds")] = None
    sample: Annotated[
        Positive | None,
        describe("seconds from one look at the state to the next; timesteps divide it"),
    ] = None
    controls: Annotated[
        tuple[tuple[float, ...], ...],
        describe("commands one after the other, each a number for every actuator"),
    ] = ()
    hold: Annotated[Positive | None, describe("seconds for which each command holds")] = None
    act: Annotated[tuple[float, ...], describe("activations of actuators at the beginning")] = ()
    push: Annotated[
        tuple[PushTable, ...], describe("forces on bodies; commands then hold for parts of `hold`")
    ] = ()
    poses: Annotated[
        dict[str, Annotated[tuple[Pose, ...], Meta(min_length=1)]],
        describe(
            "of mocap bodies, by name: places (m) and quaternions one after the other, each for "
            "`hold` seconds, the last to the end"
        ),
    ] = {}
    draw: Annotated[
        dict[
            str,
            tuple[float, float]
            | Annotated[str, matching(_SHARE, "two values, or a share: `±1 %`")],
        ],
        describe(
            "parameters for which verdicts have to hold too, named as in sweeps, with their ranges"
        ),
    ] = {}
    draws: Annotated[int, describe("how often all of them are drawn", ge=1, le=100)] = 3
    measure: Annotated[
        Annotated[
            str, matching(r"^(body|site|sensor):\S.*$", "`body:NAME`, `site:NAME` or `sensor:NAME`")
        ]
        | None,
        describe("what is compared beside coordinates, as in `site:tip`"),
    ] = None
    reference: Annotated[
        Literal["ode", "self"] | None,
        describe("what errors are measured against, where not whichever fits"),
    ] = None
    conserved: Annotated[
        tuple[Literal["energy", "angular-momentum"], ...] | None,
        describe("what does not change, where it cannot be told from the model"),
    ] = None
    timesteps: Annotated[
        tuple[Positive, ...], describe("seconds; instead of a ladder about the model's own")
    ] = ()
    expected: Annotated[
        dict[Expected, float],
        describe(
            "in theory: of the hardest hit the speed after it over that before; "
            "the deepest contact and the longest slide, m; of the sensor that `measure` names when "
            "it first changes its sign, s, its last reading, the largest and the smallest"
        ),
    ] = {}
    precision: Annotated[
        Positive | None, describe("by how much `NAME.exact.py` may differ from an integration")
    ] = None
    horizon_error: Annotated[
        dict[Literal["rad", "m"], Positive],
        describe(
            "the error at which predictions of a chaotic motion end, in rad for hinges "
            "and attitudes, in m for slides and places, as in `{ rad = 0.05, m = 0.002 }`; else "
            "0.1 rad, or a tenth of the model's extent"
        ),
    ] = {}
    stable_for: Annotated[
        Positive | None,
        describe("seconds over which a timestep has to be stable; else the duration"),
    ] = None
    search: Annotated[
        tuple[Positive, Positive] | None,
        describe("seconds; the timesteps between which the largest stable one is sought"),
    ] = None

    @property
    def observable(self) -> Measured | None:
        match (self.measure or "").split(":", 1):
            case ["body" | "site" | "sensor" as kind, name]:
                return Measured(kind, name)
            case _:
                return None


class DeclaredScenario(ScenarioTable, frozen=True, kw_only=True):
    """A scenario that an author declared, or that a model without declarations has."""

    span: Span
    places: tuple[tuple[str, Span], ...] = ()

    def place(self, name: str) -> Span:
        """The span of a field's value, or of the table if the field is not given."""
        return dict(self.places).get(name, self.span)


SweepValue: TypeAlias = float | str | tuple[float, ...]


class Variation(Struct, frozen=True):
    """A parameter, and the values that a sweep gives it."""

    parameter: str
    """A field of all elements of a kind, `geom.solref[0]`, or of one, `geom:ball.mass`."""
    values: tuple[SweepValue, ...]
    relative: bool
    """Whether the values are factors of the model's own."""
    span: Span


SweepFigure: TypeAlias = Literal[
    "change", "figure", "penetration", "slip", "restitution", "residual", "iterations", "cost"
]  # fmt: skip
_WORD: TypeAlias = Annotated[
    str, matching(r"^[^±%]*$", "a number or a word of MuJoCo's; a share stands alone: `±1 %`")
]
_NUMBERS: TypeAlias = Annotated[tuple[float, ...], Meta(min_length=1)]


class SweepTable(Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of the model at other values, one at a time."""

    name: Annotated[Slug, describe("by which reports call it")]
    vary: Annotated[
        dict[
            str,
            Annotated[tuple[float | _WORD | _NUMBERS, ...], Meta(min_length=1)]
            | Annotated[str, matching(_SHARE, "values, or a share: `±1 %`")],
        ],
        describe("values by parameter, such as `geom.solref[0]`, `option.cone`"),
    ]
    title: Annotated[fields.Text | None, describe("shown over its figures")] = None
    scenario: Annotated[Slug | None, describe("the first one where it is left out")] = None
    show: Annotated[
        tuple[SweepFigure, ...], describe("figures; those that differ where none is named")
    ] = ()


class DeclaredSweep(SweepTable, frozen=True, kw_only=True):
    """A sweep with its variations parsed."""

    variations: tuple[Variation, ...]


class KeepTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A finding of the scene diet that is to stay as it is."""

    finding: Annotated[fields.Text, describe("as `diet` names it")]
    reason: Annotated[fields.Text, describe("why it stays")]


class Keep(KeepTable, frozen=True, kw_only=True):
    """A kept finding with its place."""

    finding_span: Span


class Declarations(Struct, frozen=True):
    """A file `models/NAME.toml`, or the defaults of a model without one."""

    model: str
    """The name of the model: its path below `models/`, without suffix, POSIX."""
    source: Source
    """The file, or the model's source if there is none."""
    scenarios: tuple[DeclaredScenario, ...] = ()
    keep: tuple[Keep, ...] = ()
    bench: BenchTable = BenchTable()
    sweeps: tuple[DeclaredSweep, ...] = ()
