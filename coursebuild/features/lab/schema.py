"""The fields of a `lab` fence; `relations` checks how they fit together."""

# No `from __future__ import annotations` here: msgspec would evaluate each annotation, a text then,
# again in every struct that inherits it.

from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args

from msgspec import Meta, Struct

from coursebuild.core.model.fields import (
    BELOW_ONE,
    BoundFloat,
    Digits,
    Inlines,
    NotNegative,
    OptionalBlocks,
    Positive,
    RelativeTolerance,
    Text,
)

Overlay: TypeAlias = Literal[
    "frames",
    "contacts",
    "forces",
    "com",
    "inertia",
    "joints",
    "momentum",
    "angularMomentum",
    "axis",
]
OVERLAYS: tuple[Overlay, ...] = get_args(Overlay)
Scalar: TypeAlias = float | str
Step: TypeAlias = Text | dict[str, Scalar]
FILM_RATE = 10
"""Pictures of a film in a second, as in `record.js`."""
Height: TypeAlias = Annotated[int, Meta(ge=80, le=2000)]
JAVASCRIPT_NAME = r"^[A-Za-z_$][A-Za-z0-9_$]*$"


class Overlays(Struct, frozen=True, forbid_unknown_fields=True):
    """Which overlays start on, one by one."""

    frames: bool = False
    contacts: bool = False
    forces: bool = False
    com: bool = False
    inertia: bool = False
    joints: bool = False
    momentum: bool = False
    angularMomentum: bool = False  # noqa: N815  # the author's spelling
    axis: bool = False


class Camera(Struct, frozen=True, forbid_unknown_fields=True):
    """The free camera of MuJoCo; what is left out is the engine's default for the model."""

    azimuth: Annotated[float | None, Meta(description="degrees")] = None
    elevation: Annotated[float | None, Meta(description="degrees, negative to look down")] = None
    distance: Annotated[Positive | None, Meta(description="from the target, in metres")] = None
    target: Annotated[
        tuple[float, float, float] | None, Meta(description="the point looked at, in metres")
    ] = None


class SettingFields(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What a slider and a select share: a value, and what becomes of it."""

    label: Annotated[Text, Meta(description="unique among the controls of the lab")]
    set: Annotated[
        Text | None, Meta(description="an assignable expression, as in `model.opt.timestep`")
    ] = None
    apply: Annotated[Text | None, Meta(description="statements that read `value`")] = None
    param: Annotated[
        Annotated[
            str,
            Meta(pattern=JAVASCRIPT_NAME, extra={"expects": "a name of JavaScript, in ASCII"}),
        ]
        | None,
        Meta(description="the value is stored as `ctx.NAME`"),
    ] = None
    init: Annotated[bool, Meta(description="applied again after every reset")] = False
    reset: Annotated[bool, Meta(description="changing it resets the simulation")] = False


class Slider(SettingFields, frozen=True, kw_only=True, tag_field="type", tag="slider"):
    """A slider: the control that `type` need not name."""

    implied: ClassVar[bool] = True

    min: Annotated[float, Meta(description="the left end")]
    max: Annotated[float, Meta(description="the right end")]
    value: Annotated[float, Meta(description="where it starts")]
    step: Annotated[Positive | None, Meta(description="the grid of its values")] = None
    unit: Annotated[str, Meta(description="shown after the value")] = ""
    digits: Annotated[Digits | None, Meta(description="decimal places shown")] = None

    @property
    def start(self) -> float:
        """The value with which it starts."""
        return self.value


class Select(SettingFields, frozen=True, kw_only=True, tag_field="type", tag="select"):
    """A choice between named values."""

    options: Annotated[
        tuple[tuple[Text, Scalar], ...],
        Meta(min_length=1, description="pairs of a label and a value"),
    ]
    value: Annotated[Scalar | None, Meta(description="where it starts; else the first")] = None
    unit: Annotated[str, Meta(description="shown after the value")] = ""

    @property
    def start(self) -> Scalar:
        """The value with which it starts."""
        return self.options[0][1] if self.value is None else self.value


class Button(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="button"):
    """A button that runs statements."""

    label: Annotated[Text, Meta(description="unique among the controls of the lab")]
    run: Annotated[Text, Meta(description="statements run when it is pressed")]
    play: Annotated[bool, Meta(description="pressing it starts the motion")] = True


Control: TypeAlias = Slider | Select | Button


class Readout(Struct, frozen=True, forbid_unknown_fields=True):
    """Numbers and texts shown while the simulation runs."""

    label: Annotated[Text, Meta(description="plain text")]
    expr: Annotated[Text, Meta(description="an expression that gives a number or a string")]
    digits: Annotated[Digits, Meta(description="decimal places of a number")] = 3


class TraceFields(Struct, frozen=True, forbid_unknown_fields=True):
    """The lines of a plot."""

    label: Annotated[Text, Meta(description="plain text")]
    expr: Annotated[Text, Meta(description="an expression that gives a number")]
    dash: Annotated[
        bool | Annotated[tuple[NotNegative, ...], Meta(min_length=1)],
        Meta(description="dashed, or the lengths of dashes and gaps in px; else by its place"),
    ] = False


class RefLine(Struct, frozen=True, forbid_unknown_fields=True):
    """Horizontal lines across a plot."""

    y: Annotated[BoundFloat, Meta(description="its height")]
    label: Annotated[str, Meta(description="plain text")] = ""


class PlotFields(Struct, frozen=True, forbid_unknown_fields=True):
    """What plots of all kinds have."""

    traces: Annotated[tuple[TraceFields, ...], Meta(min_length=1, description="its lines")]
    ylabel: Annotated[str, Meta(description="of the vertical axis")] = ""
    xlabel: Annotated[str, Meta(description="of the horizontal axis")] = ""
    ymin: Annotated[float | None, Meta(description="the least value shown")] = None
    ymax: Annotated[float | None, Meta(description="the greatest value shown")] = None
    height: Annotated[Annotated[int, Meta(ge=40, le=2000)] | None, Meta(description="in px")] = None
    refLines: tuple[RefLine, ...] = ()  # noqa: N815  # the author's spelling


class Plot(PlotFields, frozen=True):
    """Plots against simulated time, or one quantity against another."""

    x: Annotated[Text | None, Meta(description="an expression in place of the time")] = None
    window: Annotated[Positive | None, Meta(description="seconds shown; else all")] = None


class Expect(Struct, frozen=True, forbid_unknown_fields=True):
    """A claim that the build proves of the time `t`.

    `expr` is at least `min` and at most `max`, or the simulation has diverged.
    """

    t: Annotated[NotNegative, Meta(description="simulated time in seconds")]
    expr: Annotated[Text | None, Meta(description="an expression that gives a number")] = None
    diverges: Annotated[bool, Meta(description="the simulation diverges, no later than at `t`")] = (
        False
    )
    after: Annotated[
        Step | Annotated[tuple[Step, ...], Meta(min_length=1)] | None,
        Meta(
            description="the label of a button to press, or values of controls by their labels; "
            "or a list of these, done in order"
        ),
    ] = None
    min: Annotated[float | None, Meta(description="`expr` is not below")] = None
    max: Annotated[float | None, Meta(description="`expr` is not above")] = None

    @property
    def steps(self) -> tuple[Step, ...]:
        """What is done before, in order; empty if the claim is about the lab as it starts."""
        if self.after is None:
            return ()
        return self.after if isinstance(self.after, tuple) else (self.after,)

    @property
    def controls(self) -> frozenset[str]:
        """The labels of the controls used in those steps."""
        return frozenset(
            label for step in self.steps for label in ((step,) if isinstance(step, str) else step)
        )


class LogEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """Something that is done while a lab runs."""

    t: Annotated[NotNegative, Meta(description="simulated time in seconds")]
    do: Annotated[
        Step,
        Meta(description="the label of a button to press, or values of controls by their labels"),
    ]


class Goal(Struct, frozen=True, forbid_unknown_fields=True):
    """What the reader is asked to reach; the build proves that the log reaches it."""

    text: Annotated[Inlines, Meta(description="what is asked, a line of Markdown")]
    expr: Annotated[Text, Meta(description="an expression that gives `true` or `false`")]
    log: Annotated[tuple[LogEntry, ...], Meta(description="what is done to reach it, in order")]
    hold: Annotated[
        NotNegative, Meta(description="how long `expr` has to stay true, in simulated seconds")
    ] = 0


class Verify(Struct, frozen=True, forbid_unknown_fields=True):
    """How much of the lab the build runs."""

    seconds: Annotated[Positive | None, Meta(description="simulated time")] = None
    rtol: Annotated[
        RelativeTolerance | None,
        Meta(description="relative difference allowed to the native engine"),
    ] = None
    deep: Annotated[bool, Meta(description="whether bodies are meant to overlap deeply")] = False


class LegendEntry(Struct, frozen=True, forbid_unknown_fields=True):
    """What an overlay shows, and the symbol that lights with it."""

    overlay: Annotated[Overlay, Meta(description="the overlay")]
    text: Annotated[Inlines, Meta(description="a line of Markdown that begins with its symbol")]


class CommonLab(Struct, frozen=True):
    """What labs of every kind have; a kind's own code reads the rest."""

    title: Annotated[str, Meta(description="the caption; plain text")] = ""
    note: Annotated[OptionalBlocks, Meta(description="Markdown under the lab")] = ""
    height: Annotated[Height, Meta(description="of a picture 480 px wide, in px")] = 300
    dock: Annotated[bool, Meta(description="stays beside the text on wide screens")] = False


class SimLab(CommonLab, frozen=True, forbid_unknown_fields=True):
    """A live MuJoCo simulation; `model` or `xml` is required."""

    model: Annotated[Text | None, Meta(description="the name of a model in models/")] = None
    xml: Annotated[Text | None, Meta(description="the model itself, as MJCF")] = None
    key: Annotated[
        Annotated[int, Meta(ge=0)] | Text | None,
        Meta(description="the keyframe to start and reset from: its index or name"),
    ] = None
    camera: Camera | None = None
    toggles: Annotated[tuple[Overlay, ...], Meta(description="overlays that can be switched")] = ()
    overlays: Annotated[
        tuple[Overlay, ...] | Overlays, Meta(description="overlays that start on")
    ] = ()
    legend: Annotated[tuple[LegendEntry, ...], Meta(description="symbols of what is drawn")] = ()
    forceScale: Annotated[Positive | None, Meta(description="of drawn forces, in m/N")] = None  # noqa: N815
    autoplay: Annotated[bool, Meta(description="starts running")] = False
    grab: Annotated[
        bool, Meta(description="a mouse or a finger takes hold of bodies from the start")
    ] = False
    stopAt: Annotated[  # noqa: N815
        Positive | None, Meta(description="pauses at this simulated time, in seconds")
    ] = None
    start: Annotated[
        Text | None, Meta(description="the label of the button that Play presses at the start")
    ] = None
    still: Annotated[str, Meta(description="why nothing moves when a reader presses Play")] = ""
    film: Annotated[
        Annotated[float, Meta(ge=0.5, le=2.5)] | None,
        Meta(description="seconds after Play that the card of a path shows in motion"),
    ] = None
    setup: Annotated[str, Meta(description="statements run after load and every reset")] = ""
    controller: Annotated[str, Meta(description="statements run before every step")] = ""
    controls: Annotated[tuple[Control, ...], Meta(description="sliders, selects and buttons")] = ()
    readouts: tuple[Readout, ...] = ()
    plots: tuple[Plot, ...] = ()
    trail: Annotated[Text | None, Meta(description="a site whose path is drawn")] = None
    expect: Annotated[tuple[Expect, ...], Meta(description="claims that the build proves")] = ()
    goal: Annotated[Goal | None, Meta(description="what the reader is asked to reach")] = None
    seed: Annotated[
        Annotated[int, Meta(ge=0, le=4294967295)] | None, Meta(description="of random numbers")
    ] = None
    verify: Verify | None = None


def refine_schema(definitions: dict[str, Any]) -> None:
    """Add to a JSON Schema what the types do not say: a lab has either `model` or `xml`."""
    if "Slider" in definitions:  # the tag that an author may leave out
        definitions["Slider"]["required"].remove("type")
    if "SimLab" in definitions:
        definitions["SimLab"]["oneOf"] = [{"required": ["model"]}, {"required": ["xml"]}]


# --- labs without an engine: `lab plot` and `lab ode`

Formula: TypeAlias = float | Text
Column: TypeAlias = Annotated[int, Meta(ge=1, le=100)]
Values: TypeAlias = Annotated[
    dict[str, Scalar], Meta(description="the controls that are set before, by their labels")
]


class Axis(Struct, frozen=True, forbid_unknown_fields=True):
    """The variable along which curves are drawn."""

    max: Annotated[float, Meta(description="its right end")]
    min: Annotated[float, Meta(description="its left end")] = 0
    name: Annotated[
        Text | None, Meta(description="its name in formulas; else that of the field")
    ] = None
    label: Annotated[str, Meta(description="what it is; plain text")] = ""
    unit: Annotated[str, Meta(description="shown after the label")] = ""
    at: Annotated[
        float | None, Meta(description="where the point on the curves is at first; else `min`")
    ] = None


class Points(Struct, frozen=True, forbid_unknown_fields=True):
    """Numbers that a script of the course has printed, on or beside the first trace."""

    script: Annotated[Text, Meta(description="the path of the script, as its fence names it")]
    within: Annotated[
        Positive, Meta(description="how far from the first trace a number may be, in its unit")
    ]
    x: Annotated[Column, Meta(description="the column of the axis in its recorded output")] = 1
    y: Annotated[Column, Meta(description="the column of the trace")] = 2
    label: Annotated[str, Meta(description="plain text beside the last point")] = ""


class EquationPlot(PlotFields, frozen=True, kw_only=True):
    """A plot of a lab without an engine."""

    x: Annotated[
        Text | None, Meta(description="an expression for the horizontal axis: a phase plane")
    ] = None
    xmin: Annotated[float | None, Meta(description="the least value shown of `x`")] = None
    xmax: Annotated[float | None, Meta(description="the greatest value shown of `x`")] = None
    field: Annotated[
        bool, Meta(description="arrows show where motion leads; `x` and the trace are states")
    ] = False
    points: Annotated[
        Points | None, Meta(description="numbers that a script of the course has printed")
    ] = None


class State(Struct, frozen=True, forbid_unknown_fields=True):
    """A quantity that changes by an equation."""

    start: Annotated[Formula, Meta(description="its value at the start")]
    rate: Annotated[Formula, Meta(description="its derivative")]


class Event(Struct, frozen=True, forbid_unknown_fields=True):
    """Something that happens when a condition becomes true."""

    when: Annotated[Text, Meta(description="a comparison, as `height < 0`")]
    set: Annotated[dict[str, Formula], Meta(description="new values of states")] = {}
    stop: Annotated[
        bool | Text, Meta(description="whether the run ends, or a condition by which it does")
    ] = False


class CurveClaim(Struct, frozen=True, forbid_unknown_fields=True):
    """What the build proves of a place on the axis."""

    at: Annotated[float, Meta(description="a value of the axis")]
    expr: Annotated[Text | None, Meta(description="an expression")] = None
    diverges: Annotated[bool, Meta(description="the solution ends, no later than there")] = False
    after: Values = {}
    min: Annotated[float | None, Meta(description="`expr` is not below")] = None
    max: Annotated[float | None, Meta(description="`expr` is not above")] = None


class Challenge(Struct, frozen=True, forbid_unknown_fields=True):
    """What the reader is asked to reach; the build proves that it can be."""

    text: Annotated[Inlines, Meta(description="what is asked, a line of Markdown")]
    expr: Annotated[Text, Meta(description="a condition that has to become true")]
    after: Annotated[Values, Meta(description="values of controls that reach it")]
    hold: Annotated[NotNegative, Meta(description="how long it has to stay true")] = 0


class Tolerance(Struct, frozen=True, forbid_unknown_fields=True):
    """How closely SciPy has to agree."""

    rtol: Annotated[
        Annotated[Positive, BELOW_ONE],
        Meta(description="difference, relative to the largest value of a state"),
    ] = 1e-6
    until: Annotated[
        float | None, Meta(description="where on the axis the comparison ends; else everywhere")
    ] = None


class EquationLab(CommonLab, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What both kinds have."""

    plots: tuple[EquationPlot, ...] = ()

    height: Annotated[Height, Meta(description="of a plot 480 px wide, in px")] = 260
    where: Annotated[
        dict[str, Formula], Meta(description="names for numbers and expressions, in order")
    ] = {}
    controls: Annotated[tuple[Control, ...], Meta(description="sliders and selects")] = ()
    readouts: Annotated[tuple[Readout, ...], Meta(description="numbers at the point")] = ()
    expect: Annotated[tuple[CurveClaim, ...], Meta(description="claims that the build proves")] = ()
    goal: Annotated[Challenge | None, Meta(description="what the reader is asked to reach")] = None
    verify: Annotated[Tolerance | None, Meta(description="how closely SciPy has to agree")] = None
    play: Annotated[
        Positive | None, Meta(description="how long a run takes at the usual speed, in seconds")
    ] = None


class PlotLab(EquationLab, frozen=True, kw_only=True):
    """A `lab plot`: expressions over a range."""

    x: Annotated[Axis, Meta(description="the range")]
    plots: Annotated[tuple[EquationPlot, ...], Meta(min_length=1, description="the plots")]


class OdeLab(EquationLab, frozen=True, kw_only=True):
    """A `lab ode`: equations that are solved."""

    t: Annotated[Axis, Meta(description="the time")]
    states: Annotated[dict[str, State], Meta(min_length=1, description="the states by their names")]
    events: Annotated[tuple[Event, ...], Meta(description="what happens on the way")] = ()
    plots: Annotated[
        tuple[EquationPlot, ...], Meta(description="the plots; without them, one of all states")
    ] = ()
