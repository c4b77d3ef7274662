"""What a file `NAME.toml` beside a model declares: scenarios, sweeps, and findings to keep.

`schemas/scenarios.schema.json` has the same with a description of each key. What is left out is
`None` or empty; measuring fills it in from the model.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import asdict

DURATION, MOST_STEPS = 2.0, 20_000
"""The length of a scenario that does not say its own: seconds, and the most timesteps."""
Positive: TypeAlias = Annotated[float, Meta(gt=0)]
Share: TypeAlias = Annotated[float, Meta(gt=0, le=1)]
Slug: TypeAlias = Annotated[str, Meta(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")]
Text: TypeAlias = Annotated[str, Meta(pattern=r"\S")]
Deviation: TypeAlias = Annotated[str, Meta(pattern=r"^±\s*(?!0+(?:\.0+)?\s*%)\d+(?:\.\d+)?\s*%$")]
"""To both sides of the model's own value, as in `± 10 %`."""
Expected: TypeAlias = Literal[
    "restitution", "penetration", "slip", "crossing", "last", "largest", "smallest"
]
SweepFigure: TypeAlias = Literal[
    "change", "figure", "penetration", "slip", "restitution", "residual", "iterations", "cost"
]  # fmt: skip
Pose: TypeAlias = tuple[float, float, float, float, float, float, float]
SweepValue: TypeAlias = float | str | tuple[float, ...]


def keyframe_scenarios(keyframes: Sequence[str]) -> tuple[str, ...]:
    """The scenarios of a model that declares none: one for each keyframe, or `start`."""
    names: list[str] = []
    for number, keyframe in enumerate(keyframes):
        name = keyframe if keyframe.strip() else f"keyframe-{number}"
        while not keyframe.strip() and name in keyframes:
            name += "-"
        names.append(name)
    return tuple(names) or ("start",)


def is_multiple(length: float, part: float) -> bool:
    """Whether `length` is a whole multiple of `part`, up to rounding."""
    count = round(length / part) if length / part < 1e15 else 0
    return count >= 1 and abs(count * part - length) <= 1e-9 * length


class DeclarationError(Exception):
    """A file of declarations cannot be read; the message says why, without the file's name."""


class Place(Struct, frozen=True):
    """A file, and in TOML the keys that lead to a value; tables of a kind count from 0."""

    path: str
    keys: tuple[str | int, ...] = ()

    def __str__(self) -> str:
        return f"{self.path}: {'.'.join(map(str, self.keys))}" if self.keys else self.path


class BenchTable(Struct, frozen=True, forbid_unknown_fields=True):
    """The size from which an error is visible, and by how much it may differ."""

    visible: Share = 0.01
    visible_angle: Annotated[float, Meta(gt=0, le=180)] = 1.0
    band: Share = 0.05
    order_band: Share = 0.05


class Measured(Struct, frozen=True):
    """A quantity measured besides coordinates: a position, or the reading of a sensor."""

    kind: Literal["body", "site", "sensor"]
    name: str


class PushTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A force on a body, for a while."""

    body: Text
    at: Annotated[float, Meta(ge=0)]
    duration: Positive
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque: tuple[float, float, float] = (0.0, 0.0, 0.0)


class ScenarioTable(Struct, frozen=True, forbid_unknown_fields=True):
    """What happens to the model: initial state, duration, commands."""

    name: Slug
    title: Text | None = None
    keyframe: Annotated[int, Meta(ge=0)] | Text | None = None
    qpos: tuple[float, ...] = ()
    qvel: tuple[float, ...] = ()
    duration: Positive | None = None
    sample: Positive | None = None
    controls: tuple[tuple[float, ...], ...] = ()
    hold: Positive | None = None
    act: tuple[float, ...] = ()
    push: tuple[PushTable, ...] = ()
    poses: dict[str, Annotated[tuple[Pose, ...], Meta(min_length=1)]] = {}
    draw: dict[str, tuple[float, float] | Deviation] = {}
    draws: Annotated[int, Meta(ge=1, le=100)] = 3
    measure: Annotated[str, Meta(pattern=r"^(body|site|sensor):\S.*$")] | None = None
    reference: Literal["ode", "self"] | None = None
    conserved: tuple[Literal["energy", "angular-momentum"], ...] | None = None
    timesteps: tuple[Positive, ...] = ()
    expected: dict[Expected, float] = {}
    precision: Positive | None = None
    horizon_error: dict[Literal["rad", "m"], Positive] = {}
    stable_for: Positive | None = None
    search: tuple[Positive, Positive] | None = None

    @property
    def observable(self) -> Measured | None:
        match (self.measure or "").split(":", 1):
            case ["body" | "site" | "sensor" as kind, name]:
                return Measured(kind, name)
            case _:
                return None


class DeclaredScenario(ScenarioTable, frozen=True, kw_only=True):
    """A scenario that an author declared, or that a model without declarations has."""

    table: Place

    def place(self, field: str) -> Place:
        """The place of a field's value."""
        return Place(self.table.path, (*self.table.keys, field))

    @property
    def ranges(self) -> tuple[Variation, ...]:
        """What is drawn, each with two values, between which it is."""
        place = self.place("draw")
        return tuple(variation(place, *pair) for pair in self.draw.items())


class Variation(Struct, frozen=True):
    """A parameter, and the values that a sweep gives it."""

    parameter: str
    """A field of all elements of a kind, `geom.solref[0]`, or of one, `geom:ball.mass`."""
    values: tuple[SweepValue, ...]
    relative: bool
    """Whether the values are factors of the model's own."""
    place: Place


class SweepTable(Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of the model at other values, one at a time."""

    name: Slug
    vary: dict[
        str,
        Annotated[tuple[float | str | tuple[float, ...], ...], Meta(min_length=1)] | Deviation,
    ]
    title: Text | None = None
    scenario: Slug | None = None
    show: tuple[SweepFigure, ...] = ()


class DeclaredSweep(SweepTable, frozen=True, kw_only=True):
    """A sweep with its variations parsed."""

    variations: tuple[Variation, ...]


class KeepTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A finding of the diet that is to stay as it is."""

    finding: Text
    reason: Text


class DeclarationFile(Struct, frozen=True, forbid_unknown_fields=True):
    """The tables of a file."""

    scenario: tuple[ScenarioTable, ...] = ()
    keep: tuple[KeepTable, ...] = ()
    bench: BenchTable = BenchTable()
    sweep: tuple[SweepTable, ...] = ()


class Declarations(Struct, frozen=True):
    """What a file declares, or the defaults of a model without one."""

    path: str
    """The file, or the model's if there is none."""
    scenarios: tuple[DeclaredScenario, ...] = ()
    keep: tuple[KeepTable, ...] = ()
    bench: BenchTable = BenchTable()
    sweeps: tuple[DeclaredSweep, ...] = ()


def parse_declarations(path: str, text: str) -> Declarations:
    """The declarations of a TOML file; `path` is what errors call it."""
    try:
        file = msgspec.convert(tomllib.loads(text), DeclarationFile)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise DeclarationError(str(error)) from None
    scenarios = tuple(
        DeclaredScenario(**asdict(table), table=Place(path, ("scenario", number)))
        for number, table in enumerate(file.scenario)
    )
    for names in ([s.name for s in scenarios], [sweep.name for sweep in file.sweep]):
        if twice := {name for name in names if names.count(name) > 1}:
            raise DeclarationError(f"the name `{min(twice)}` is given twice")
    sweeps = []
    for number, sweep in enumerate(file.sweep):
        if sweep.scenario is not None and sweep.scenario not in {s.name for s in scenarios}:
            raise DeclarationError(f"no scenario is called `{sweep.scenario}`")
        place = Place(path, ("sweep", number, "vary"))
        variations = tuple(variation(place, *pair) for pair in sweep.vary.items())
        sweeps.append(DeclaredSweep(**asdict(sweep), variations=variations))
    return Declarations(path, scenarios, file.keep, file.bench, tuple(sweeps))


def variation(table: Place, parameter: str, values: Any) -> Variation:
    """A parameter at values, or at both ends of a deviation from the model's own."""
    place = Place(table.path, (*table.keys, parameter))
    if not isinstance(values, str):
        return Variation(parameter, values, relative=False, place=place)
    share = float(values.strip("± %")) / 100
    return Variation(parameter, (1 - share, 1 + share), relative=True, place=place)
