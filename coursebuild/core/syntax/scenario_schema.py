"""The tables and fields of a file `models/NAME.toml`.

Entry point: `ModelFile`. The decoder checks the file against it, and the JSON Schema for editors is
made from it; how the fields hang together is checked in `scenarios`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from coursebuild.core.model.scenarios import VISIBLE, VISIBLE_ANGLE, Bands
from coursebuild.core.syntax.course_schema import Slug
from coursebuild.core.syntax.fields import Positive, Text

BANDS = Bands()


class BenchTable(Struct, frozen=True, forbid_unknown_fields=True):
    """From where on an error would be noticed, and what it may differ by."""

    visible: Annotated[
        Annotated[float, Meta(gt=0, le=1)], Meta(description="share of the model's extent")
    ] = VISIBLE
    visible_angle: Annotated[
        Annotated[float, Meta(gt=0, le=180)], Meta(description="degrees, for attitudes and hinges")
    ] = VISIBLE_ANGLE
    band: Annotated[
        Annotated[float, Meta(gt=0, le=1)],
        Meta(description="share by which an error may differ from the recorded one"),
    ] = BANDS.error
    order_band: Annotated[
        Annotated[float, Meta(gt=0, le=1)],
        Meta(description="by how much a fitted order may differ from the recorded one"),
    ] = BANDS.order


class ScenarioTable(Struct, frozen=True, forbid_unknown_fields=True):
    """What happens to the model: where it begins, how long it takes, what is commanded."""

    name: Annotated[Slug, Meta(description="by which reports call it")]
    title: Annotated[Text | None, Meta(description="shown over its figures")] = None
    keyframe: Annotated[
        Annotated[int, Meta(ge=0)] | Text | None,
        Meta(description="where it begins, by name or by number from 0"),
    ] = None
    qpos: Annotated[
        tuple[float, ...], Meta(description="positions at the beginning, instead of the keyframe's")
    ] = ()
    qvel: Annotated[
        tuple[float, ...],
        Meta(description="velocities at the beginning, instead of the keyframe's"),
    ] = ()
    duration: Annotated[Positive | None, Meta(description="seconds")] = None
    sample: Annotated[
        Positive | None,
        Meta(description="seconds from one look at the state to the next; timesteps divide it"),
    ] = None
    controls: Annotated[
        tuple[tuple[float, ...], ...],
        Meta(description="commands one after the other, each a number for every actuator"),
    ] = ()
    hold: Annotated[Positive | None, Meta(description="seconds for which each command holds")] = (
        None
    )
    measure: Annotated[
        Annotated[
            str,
            Meta(
                pattern=r"^(body|site|sensor):\S.*$",
                extra={"expects": "`body:NAME`, `site:NAME` or `sensor:NAME`"},
            ),
        ]
        | None,
        Meta(description="what is compared beside coordinates, as in `site:tip`"),
    ] = None
    reference: Annotated[
        Annotated[
            str,
            Meta(
                pattern=r"^(ode|self|closed:\S.*)$",
                extra={"expects": "`ode`, `self` or `closed:CASE`"},
            ),
        ]
        | None,
        Meta(description="what errors are measured against, where not whichever fits"),
    ] = None
    conserved: Annotated[
        tuple[Literal["energy", "angular-momentum"], ...] | None,
        Meta(description="what does not change, where it cannot be told from the model"),
    ] = None
    timesteps: Annotated[
        tuple[Positive, ...], Meta(description="seconds; instead of a ladder about the model's own")
    ] = ()


class KeepTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A finding of the scene diet that is wanted as it is."""

    finding: Annotated[Text, Meta(description="as `coursebuild diet` names it")]
    reason: Annotated[Text, Meta(description="why it stays")]


class ModelFile(Struct, frozen=True, forbid_unknown_fields=True):
    """What is measured on a model, and which findings of the diet are wanted."""

    bench: BenchTable | None = None
    scenario: tuple[ScenarioTable, ...] = ()
    keep: tuple[KeepTable, ...] = ()
