"""Labs as a page shows them before they run: what they are, what can be changed, what is shown.

Entry point: `lab(page, block)`. Nothing in it is a control that does nothing: the page's script
puts the live instrument into `data-lab` when it starts, and reads its configuration there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import quote

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Lab, LabControl, ModelTarget
from coursebuild.core.pages.qr import qr_svg
from coursebuild.core.pages.strings import Strings

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.page_inputs import ShownRecord


class ControlView(Struct, frozen=True):
    """A row of the table of controls."""

    label: str
    values: str
    """Range or options, and what it is at first, in words."""


class RecordedView(Struct, frozen=True):
    """What the trial recorded, ready for the template."""

    picture: str
    width: int
    height: int
    alt: str
    readouts: tuple[tuple[str, str], ...]
    plots: tuple[Markup, ...]
    at: str
    proven: str


class PaperView(Struct, frozen=True):
    """What leads from paper to the lab."""

    code: Markup
    """A QR code of the address."""
    address: str
    text: str
    """The address as one types it."""


class PlotView(Struct, frozen=True):
    """A plot: its axes and the lines in it."""

    title: str
    traces: tuple[str, ...]
    marks: tuple[str, ...]
    """Reference lines."""


def lab(page: PageContext, block: Lab) -> Markup:
    """A lab in its static form."""
    words = page.tools.words
    live = page.shown.labs.get(block.span.start)
    return page.template(
        "blocks/lab.html",
        lab=block,
        key=live.name if live is not None else None,
        config=page.place.href(live.config) if live is not None else None,
        script=page.place.href(live.script) if live is not None else None,
        recorded=_recorded(page, block, live.record) if live is not None else None,
        paper=_paper(page, live.name) if live is not None else None,
        title=block.title or words("lab.untitled"),
        note=page.blocks(block.note),
        model_href=page.href(ModelTarget(block.model)) if block.model is not None else None,
        start=start_name(page, block),
        stop=number(block.stop_at) if block.stop_at is not None else None,
        controls=tuple(control_view(words, control) for control in block.controls),
        plots=tuple(plot_view(words, block, index) for index in range(len(block.plots))),
        overlays=tuple(overlay_name(words, name) for name in block.toggles),
    )


def _paper(page: PageContext, name: str) -> PaperView | None:
    """The way from paper to a lab; `None` where nobody knows where the site will stand."""
    if not page.shown.address:
        return None
    address = f"{page.shown.address}#{quote(name)}"
    code = qr_svg(address, page.tools.words("lab.code"))
    return PaperView(code, address, address.partition("://")[2])


def _recorded(page: PageContext, block: Lab, record: ShownRecord | None) -> RecordedView | None:
    """What the trial recorded; `None` where it did not come to its end."""
    if record is None:
        return None
    words = page.tools.words
    return RecordedView(
        page.place.href(record.picture),
        record.size[0],
        record.size[1],
        words("lab.picture", title=block.title or words("lab.untitled"), t=number(record.time, 4)),
        record.readouts,
        tuple(Markup(svg) for svg in record.plots),
        words("lab.at", t=seconds(record.end)),
        words(
            "lab.proven",
            engine=page.shown.engine,
            tried=str(record.tried),
            parity=record.parity,
        ),
    )


def seconds(value: float) -> str:
    """A time, to the millisecond."""
    return number(round(value, 3))


def number(value: float, digits: int | None = None) -> str:
    """A number as a reader writes it: no trailing zeros, a real minus sign."""
    text = f"{value:.{digits}f}" if digits is not None else f"{value:.12g}"
    return text.replace("-", "\u2212")


def start_name(page: PageContext, block: Lab) -> str | None:
    """The name of the keyframe that the lab starts from."""
    if block.key is None or isinstance(block.key, str):
        return block.key
    names = page.shown.keyframes.get(block.model or "", ())
    return (names[block.key] if 0 <= block.key < len(names) else "") or str(block.key)


def control_view(words: Strings, control: LabControl) -> ControlView:
    """A control as a row of words."""
    match control.kind:
        case "slider":
            values, initial = _range(words, control), _initial(control)
        case "select":
            values = ", ".join(label for label, _ in control.options)
            chosen = (label for label, value in control.options if value == control.value)
            initial = next(chosen, "")
        case "button":
            values, initial = words("lab.button"), ""
    if initial:
        values = words("lab.initial", values=values, initial=initial)
    return ControlView(control.label, values)


def _initial(control: LabControl) -> str:
    if not isinstance(control.value, int | float):
        return ""
    return f"{number(control.value, control.digits)} {control.unit}".rstrip()


def _range(words: Strings, control: LabControl) -> str:
    if control.minimum is None or control.maximum is None:
        return control.unit
    ends = words("lab.between", min=number(control.minimum), max=number(control.maximum))
    ends = f"{ends} {control.unit}".rstrip()
    return words("lab.step", range=ends, step=number(control.step)) if control.step else ends


def plot_view(words: Strings, block: Lab, index: int) -> PlotView:
    """A plot in words."""
    plot = block.plots[index]
    title = words(
        "lab.plot",
        ylabel=plot.ylabel or words("lab.value"),
        xlabel=plot.xlabel or words("lab.time"),
    )
    marks = tuple(f"{label} ({number(y)})" if label else number(y) for y, label in plot.ref_lines)
    return PlotView(title, tuple(trace.label for trace in plot.traces), marks)


def overlay_name(words: Strings, name: str) -> str:
    """What an overlay is called."""
    return words(f"overlay.{name}") if words.has(f"overlay.{name}") else name
