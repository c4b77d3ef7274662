"""The fields of labs without an engine: `lab plot` and `lab ode`."""

# No `from __future__ import annotations` here: msgspec would evaluate each annotation, a text then,
# again in every struct that inherits it.

from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

from coursebuild.core.model.fields import Inlines, NotNegative, OptionalBlocks, Positive, Text
from coursebuild.features.lab.schema import Control, Height, PlotFields, Readout, Scalar

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
        Positive, Meta(description="difference, relative to the largest value of a state")
    ] = 1e-6
    until: Annotated[
        float | None, Meta(description="where on the axis the comparison ends; else everywhere")
    ] = None


class EquationLab(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What both kinds have."""

    plots: tuple[EquationPlot, ...] = ()

    title: Annotated[str, Meta(description="the caption; plain text")] = ""
    note: Annotated[OptionalBlocks, Meta(description="Markdown under the lab")] = ""
    height: Annotated[Height, Meta(description="of a plot 480 px wide, in px")] = 260
    dock: Annotated[bool, Meta(description="stays beside the text on wide screens")] = False
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
    states: Annotated[dict[str, State], Meta(description="the states by their names")]
    events: Annotated[tuple[Event, ...], Meta(description="what happens on the way")] = ()
    plots: Annotated[
        tuple[EquationPlot, ...], Meta(description="the plots; without them, one of all states")
    ] = ()
