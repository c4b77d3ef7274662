"""`lab` fences.

Entry points: `parse_lab` (a fence), `sim_lab` (a lab that stands inside other JSON, as in a quiz).

1. The JSON is read into nodes, and these into the declared fields.
2. A `simlab` is checked to its end; of another kind only the fields that all labs have, since the
   rest is for its own code.
3. The Markdown in it is parsed, and all of it becomes a `Lab`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from coursebuild.core.model import (
    Lab,
    LabCamera,
    LabControl,
    LabExpect,
    LabPlot,
    LabReadout,
    LabTrace,
)
from coursebuild.core.syntax.decode import decode
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.lab_checks import check_lab
from coursebuild.core.syntax.lab_schema import (
    Button,
    CommonLab,
    Expect,
    Overlays,
    Plot,
    Select,
    SimLab,
    Slider,
    Step,
)
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode, StringNode
from coursebuild.core.syntax.texts import Prose, TextParser
from coursebuild.core.syntax.wording import JSON
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, sort_diagnostics
from coursebuild.core.text.source import Excerpt, Span

SIMLAB = "simlab"
"""The kind of a lab that names none."""


def parse_lab(
    span: Span, kind: str, kind_span: Span, body: Excerpt, texts: TextParser
) -> Parsed[Lab | None]:
    """The lab of a fence; `span` is all of it and `body` the text inside. Never raises."""
    parsed = parse_json(body, span.first_line())
    node = parsed.value
    if node is None:
        return Parsed(None, sort_diagnostics(parsed.diagnostics))
    declared: type[SimLab] | type[CommonLab] = SimLab if kind == SIMLAB else CommonLab
    decoding = decode(node, declared, "the lab", JSON)
    prose = Prose.read(decoding.texts, texts)
    found: list[Diagnostic] = [*parsed.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    lab: Lab | None = None
    if isinstance(node, ObjectNode):
        if kind == SIMLAB:
            found += check_lab(node, decoding.structs)
            lab = sim_lab(span, kind_span, node, decoding.structs, prose)
        elif isinstance(decoding.value, CommonLab):
            lab = _other_lab(span, kind, kind_span, node, decoding.value, prose)
    return Parsed(None if found else lab, sort_diagnostics(found))


def sim_lab(
    span: Span,
    kind_span: Span,
    node: ObjectNode,
    structs: Mapping[ObjectNode, Struct],
    prose: Prose,
) -> Lab | None:
    """The simulation that a node describes; none when its fields are not right."""
    fields = structs.get(node)
    if not isinstance(fields, SimLab):
        return None
    xml = node.get("xml")
    verify = fields.verify
    return Lab(
        span=span,
        kind=SIMLAB,
        kind_span=kind_span,
        config=node.raw,
        title=fields.title,
        note=prose.blocks(node.get("note")),
        model=fields.model,
        model_span=_span(node, "model"),
        xml=xml.excerpt if isinstance(xml, StringNode) else None,
        height=fields.height,
        dock=fields.dock,
        key=fields.key,
        key_span=_span(node, "key"),
        camera=_camera(fields),
        toggles=tuple(fields.toggles),
        overlays=_overlays(fields.overlays),
        force_scale=fields.forceScale,
        autoplay=fields.autoplay,
        stop_at=fields.stopAt,
        setup=fields.setup,
        controller=fields.controller,
        controls=tuple(_control(n, structs[n]) for n in node.objects("controls")),
        readouts=tuple(
            LabReadout(n.span, r.label, r.expr, r.digits)
            for n, r in zip(node.objects("readouts"), fields.readouts, strict=True)
        ),
        plots=tuple(_plot(n, p) for n, p in zip(node.objects("plots"), fields.plots, strict=True)),
        trail=fields.trail,
        expect=tuple(
            _expect(n, e) for n, e in zip(node.objects("expect"), fields.expect, strict=True)
        ),
        seed=fields.seed,
        verify_seconds=verify.seconds if verify is not None else None,
        verify_rtol=verify.rtol if verify is not None else None,
        verify_deep=verify is not None and verify.deep,
        trail_span=_span(node, "trail"),
        places=tuple(_places(node, ())),
    )


def _other_lab(
    span: Span, kind: str, kind_span: Span, node: ObjectNode, fields: CommonLab, prose: Prose
) -> Lab:
    return Lab(
        span=span,
        kind=kind,
        kind_span=kind_span,
        config=node.raw,
        title=fields.title,
        note=prose.blocks(node.get("note")),
        model=None,
        model_span=None,
        xml=None,
        height=fields.height,
        dock=fields.dock,
        key=None,
        key_span=None,
        camera=None,
        toggles=(),
        overlays=(),
        force_scale=None,
        autoplay=False,
        stop_at=None,
        setup="",
        controller="",
        controls=(),
        readouts=(),
        plots=(),
        trail=None,
        expect=(),
        seed=None,
        verify_seconds=None,
        verify_rtol=None,
    )


def _places(node: Node, way: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Span]]:
    """Every value inside a node, with the way to it."""
    parts: list[tuple[str | int, Node]] = []
    if isinstance(node, ObjectNode):
        parts = [(member.key.value, member.value) for member in node.members]
    elif isinstance(node, ArrayNode):
        parts = list(enumerate(node.items))
    for name, value in parts:
        yield (*way, name), value.mark
        yield from _places(value, (*way, name))


def _span(node: ObjectNode, name: str) -> Span | None:
    value: Node | None = node.get(name)
    return None if value is None else value.span


def _camera(fields: SimLab) -> LabCamera | None:
    camera = fields.camera
    if camera is None:
        return None
    return LabCamera(camera.azimuth, camera.elevation, camera.distance, camera.target)


def _overlays(overlays: tuple[str, ...] | Overlays) -> tuple[str, ...]:
    if isinstance(overlays, Overlays):
        return tuple(name for name in Overlays.__struct_fields__ if getattr(overlays, name))
    return tuple(overlays)


def _control(node: ObjectNode, fields: Struct) -> LabControl:
    match fields:
        case Slider() as f:
            return LabControl(
                span=node.span,
                kind="slider",
                label=f.label,
                unit=f.unit,
                minimum=f.min,
                maximum=f.max,
                step=f.step,
                value=f.value,
                digits=f.digits,
                set=f.set,
                apply=f.apply,
                param=f.param,
                init=f.init,
                reset=f.reset,
            )
        case Select() as f:
            return LabControl(
                span=node.span,
                kind="select",
                label=f.label,
                unit=f.unit,
                value=f.options[0][1] if f.value is None else f.value,
                options=f.options,
                set=f.set,
                apply=f.apply,
                param=f.param,
                init=f.init,
                reset=f.reset,
            )
        case Button() as f:
            return LabControl(span=node.span, kind="button", label=f.label, run=f.run)
        case _:
            raise AssertionError(f"{fields} is no control")


def _plot(node: ObjectNode, plot: Plot) -> LabPlot:
    traces = zip(node.objects("traces"), plot.traces, strict=True)
    return LabPlot(
        span=node.span,
        ylabel=plot.ylabel,
        xlabel=plot.xlabel,
        window=plot.window,
        ymin=plot.ymin,
        ymax=plot.ymax,
        height=plot.height,
        ref_lines=tuple((line.y, line.label) for line in plot.refLines),
        traces=tuple(LabTrace(n.span, t.label, t.expr, t.dash) for n, t in traces),
    )


def _expect(node: ObjectNode, claim: Expect) -> LabExpect:
    after = tuple(tuple(step.items()) if isinstance(step, dict) else step for step in _steps(claim))
    return LabExpect(node.span, after, claim.t, claim.expr, claim.min, claim.max)


def _steps(claim: Expect) -> tuple[Step, ...]:
    if claim.after is None:
        return ()
    return claim.after if isinstance(claim.after, tuple) else (claim.after,)
