"""What a file `models/NAME.toml` says of the model beside it: scenarios, and findings to keep.

Entry points: `Declarations`; `keyframe_scenarios`, where there is no such file; `is_multiple`, of
times. What is left out is `None` or empty: whoever measures fills it in from the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.text.source import Source, Span

VISIBLE = 0.01
"""Share of a model's extent that a learner sees in a picture of it: 2 pixels of 200."""
VISIBLE_ANGLE = 1.0
"""Degrees by which an attitude must be off for a learner to see it."""
DURATION, MOST_STEPS = 2.0, 20_000
"""Seconds of a scenario that does not say how long it takes, and the model's timesteps that it is
at most."""


def keyframe_scenarios(keyframes: Sequence[str]) -> tuple[str, ...]:
    """The scenarios of a model that declares none, by name; one without a name is empty."""
    found: list[str] = []
    for number, own in enumerate(keyframes):
        name = own if own.strip() else f"keyframe-{number}"
        while not own.strip() and name in keyframes:
            name += "-"
        found.append(name)
    return tuple(found) or ("start",)


def is_multiple(length: float, part: float) -> bool:
    """Whether `part` goes into `length` a whole number of times, rounding aside."""
    count = round(length / part) if length / part < 1e15 else 0
    return count >= 1 and abs(count * part - length) <= 1e-9 * length


class Visible(Struct, frozen=True):
    """From where on an error would be noticed."""

    share: float = VISIBLE
    """Of the model's extent, for places."""
    angle: float = VISIBLE_ANGLE
    """Degrees, for attitudes and hinges."""


class Bands(Struct, frozen=True):
    """What figures may differ by from those recorded, before `--check` fails."""

    error: float = 0.05
    """Share of an error or a drift."""
    order: float = 0.05
    """Of a fitted order."""


class Measured(Struct, frozen=True):
    """What is measured beside coordinates: the place of a thing, or what a sensor says."""

    kind: Literal["body", "site", "sensor"]
    name: str

    @property
    def text(self) -> str:
        """As the file says it."""
        return f"{self.kind}:{self.name}"


class DeclaredScenario(Struct, frozen=True):
    """A scenario as its author wrote it."""

    span: Span
    """Its table."""
    name: str
    title: str
    """Empty where none is given."""
    keyframe: str | int | None
    """Where it begins, by name or by number from 0; `None`: in the model's own state."""
    qpos: tuple[float, ...]
    """Where it begins, instead of the keyframe's; empty where the keyframe's hold."""
    qvel: tuple[float, ...]
    duration: float | None
    """s."""
    sample: float | None
    """s from one look at the state to the next."""
    controls: tuple[tuple[float, ...], ...]
    """Commands one after the other, each for `hold`, the last to the end."""
    hold: float | None
    """s."""
    measure: Measured | None
    reference: Literal["ode", "self"] | None
    """`None`: whichever fits."""
    closed: str
    """The hard case whose closed form is the reference; empty where none is."""
    conserved: tuple[Literal["energy", "angular-momentum"], ...] | None
    """`None`: as far as it can be told from the model."""
    timesteps: tuple[float, ...]
    """Those to measure beside the model's own, s; empty: a ladder about the model's own."""
    places: tuple[tuple[str, Span], ...]
    """Where each field that is given stands."""

    def place(self, name: str) -> Span:
        """What to point at for a field: its value, or the table where it is not given."""
        return dict(self.places).get(name, self.span)


SweepValue: TypeAlias = float | str | tuple[float, ...]


class Variation(Struct, frozen=True):
    """A parameter, and the values that it is given."""

    parameter: str
    """As `geom.solref[0]`: a field of all elements of a kind, or of one, as in `geom:ball.mass`."""
    values: tuple[SweepValue, ...]
    relative: bool
    """Whether values are factors of what the model has."""
    span: Span


class DeclaredSweep(Struct, frozen=True):
    """Parameters to be varied, one at a time, as their author wrote it."""

    span: Span
    """Its table."""
    name: str
    title: str
    scenario: str
    """By name; empty: the first one."""
    vary: tuple[Variation, ...]
    show: tuple[str, ...]
    """The figures that it is about; empty: those that differ."""


class Keep(Struct, frozen=True):
    """A finding of the scene diet that is wanted as it is."""

    span: Span
    """Its table."""
    finding: str
    """As the diet names it."""
    reason: str
    finding_span: Span


class Declarations(Struct, frozen=True):
    """A file `models/NAME.toml`."""

    model: str
    """Its path below `models/`, without suffix, POSIX: the name of the model."""
    source: Source
    scenarios: tuple[DeclaredScenario, ...]
    visible: Visible
    keep: tuple[Keep, ...]
    bands: Bands = Bands()
    sweeps: tuple[DeclaredSweep, ...] = ()
