"""Labs: what a reader plays with.

Entry point: `Lab`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Span

if TYPE_CHECKING:
    from coursebuild.core.model.blocks import Block


class LabControl(Struct, frozen=True):
    """A control of a lab.

    For a slider `minimum` … `step` are set, for a select `options`, for a button `run`.
    """

    span: Span
    kind: Literal["slider", "select", "button"]
    label: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    step: float | None = None
    value: float | str | None = None
    digits: int | None = None
    options: tuple[tuple[str, float | str], ...] = ()
    set: str | None = None
    apply: str | None = None
    param: str | None = None
    run: str | None = None
    init: bool = False
    reset: bool = False


class LabReadout(Struct, frozen=True):
    """A number or text that the lab shows while it runs."""

    span: Span
    label: str
    expr: str
    digits: int


class LabTrace(Struct, frozen=True):
    """One line of a plot."""

    span: Span
    label: str
    expr: str
    dash: bool | tuple[float, ...]


class LabPlot(Struct, frozen=True):
    """A plot against simulated time (s)."""

    span: Span
    ylabel: str
    xlabel: str
    window: float | None
    """Seconds shown; `None`: all."""
    ymin: float | None
    ymax: float | None
    height: int | None
    ref_lines: tuple[tuple[float, str], ...]
    traces: tuple[LabTrace, ...]


LabStep: TypeAlias = str | tuple[tuple[str, float | str], ...]
"""What a reader does to a lab: the label of a button pressed, or labels of controls with values."""


class LabExpect(Struct, frozen=True):
    """A claim that the build proves.

    `expr` lies in `[minimum, maximum]` at time `t` (s) after `after`.
    """

    span: Span
    after: tuple[LabStep, ...]
    """Done in order at the start; none: the claim is of the lab as it starts."""
    t: float
    expr: str
    minimum: float | None
    maximum: float | None


class Lab(Struct, frozen=True):
    """A live simulation. See LABS: exactly one of `model` and `xml` is given for `simlab`."""

    span: Span
    kind: str
    """`simlab`, or the name of a kind that the course adds."""
    kind_span: Span
    config: str
    """The JSON as written, for the browser and for kinds that only their own code understands."""
    title: str
    note: tuple[Block, ...]
    model: str | None
    model_span: Span | None
    xml: Excerpt | None
    height: int
    dock: bool
    key: int | str | None
    key_span: Span | None
    camera: LabCamera | None
    toggles: tuple[str, ...]
    overlays: tuple[str, ...]
    """Overlays that start on."""
    force_scale: float | None
    """m/N."""
    autoplay: bool
    stop_at: float | None
    setup: str
    controller: str
    controls: tuple[LabControl, ...]
    readouts: tuple[LabReadout, ...]
    plots: tuple[LabPlot, ...]
    trail: str | None
    expect: tuple[LabExpect, ...]
    seed: int | None
    verify_seconds: float | None
    verify_rtol: float | None
    verify_deep: bool = False
    """Whether bodies are to lie deep in each other."""
    trail_span: Span | None = None
    places: tuple[tuple[tuple[str | int, ...], Span], ...] = ()
    """Where each value of the JSON stands, by the way to it: `("controls", 2, "set")`."""


class LabCamera(Struct, frozen=True):
    """MuJoCo's free camera: degrees and metres; `None` is the engine's default for the model."""

    azimuth: float | None
    elevation: float | None
    distance: float | None
    target: tuple[float, float, float] | None
