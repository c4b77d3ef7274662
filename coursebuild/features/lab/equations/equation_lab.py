"""Labs without an engine: `lab plot` and `lab ode`, from their TOML or JSON to a `Lab`.

Each expression becomes a program over an environment: the variable of the axis, then the states,
the controls and the definitions, each in its slot. What the page and the trial run is in
`Lab.config`; `Lab.fields` has what labs of all kinds show of themselves.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from keyword import iskeyword
from typing import Any

from msgspec import Struct, convert, to_builtins

from coursebuild.api import (
    Diagnostic,
    Excerpt,
    Parsed,
    Prose,
    Span,
    TextParser,
    decode,
    diagnose,
    did_you_mean,
    parse_json,
    parse_toml,
)
from coursebuild.core.syntax.nodes import (
    JSON,
    TOML,
    ArrayNode,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.core.text.units import check_unit
from coursebuild.features.lab import relations, schema
from coursebuild.features.lab.compile import control_data
from coursebuild.features.lab.equations.formula import (
    ARITIES,
    CONSTANTS,
    Program,
    compile_condition,
    compile_formula,
    normalise_name,
)
from coursebuild.features.lab.model import PLOT, Lab, values_in

_FOREIGN = ("set", "apply", "init", "reset")
"""Fields of controls that act on a simulation."""


def parse_equations(
    span: Span, kind: str, kind_span: Span, body: Excerpt, texts: TextParser
) -> Parsed[Lab | None]:
    """Parse a lab of the kind `plot` or `ode`. Never raises."""
    is_json = body.text.lstrip().startswith("{")
    text: Parsed[Any] = (
        parse_json(body, span.first_line()) if is_json else parse_toml(body, rule="toml-syntax")
    )
    if text.value is None:
        return Parsed(None, sort_diagnostics(text.diagnostics))
    fields_type: type[schema.EquationLab] = schema.PlotLab if kind == PLOT else schema.OdeLab
    form, comma = JSON if is_json else TOML, texts.has_decimal_comma
    decoding = decode(text.value, fields_type, "the lab", form, comma=comma)
    prose = Prose.read(decoding.texts, texts)
    diagnostics = [*text.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    node, lab = text.value, None
    if isinstance(node, ObjectNode):
        diagnostics += _check(node, decoding.structs)
        if isinstance(decoding.value, fields_type):
            compiler = _Compiler(kind, node, decoding.value)
            config = compiler.compile()
            diagnostics += compiler.diagnostics
            goal = node.get("goal")
            lab = Lab(
                span=span,
                kind=kind,
                kind_span=kind_span,
                config=json.dumps(config, ensure_ascii=False, separators=(",", ":")),
                fields=_common_fields(decoding.value, config),
                note=prose.blocks(node.get("note")),
                goal=prose.inlines(goal.get("text") if isinstance(goal, ObjectNode) else None),
                places=tuple((path, value.mark) for path, value in values_in(node, ())),
                numbers=relations.plotted_numbers(prose.numbers, node),
            )
    return Parsed(None if diagnostics else lab, sort_diagnostics(diagnostics))


def _common_fields(fields: schema.EquationLab, config: Mapping[str, Any]) -> schema.SimLab:
    """What the static form, copies and the search know of a lab of any kind."""
    goal = fields.goal
    return schema.SimLab(
        title=fields.title,
        height=fields.height,
        dock=fields.dock,
        controls=fields.controls,
        readouts=fields.readouts,
        plots=tuple(
            convert(
                {name: plot[name] for name in schema.PlotFields.__struct_fields__}
                | {
                    "traces": [
                        {"label": t["label"], "dash": t["dash"], "expr": "0"}
                        for t in plot["traces"]
                    ]
                },
                schema.Plot,
            )
            for plot in config["plots"]
        ),
        goal=None if goal is None else schema.Goal(goal.text, goal.expr, (), goal.hold),
    )


def _check(node: ObjectNode, structs: Mapping[ObjectNode, Struct]) -> Iterator[Diagnostic]:
    yield from relations.check_controls(node, structs, ("param",))
    yield from relations.check_axes(node, structs)
    for plot in node.objects("plots"):
        if "points" in plot.members and "x" in plot.members:
            message, help = "points belong to the axis of the lab", "leave `x` out"
            yield diagnose("field-value", plot.place("points"), message, help=help)
    for control in node.objects("controls"):
        match structs.get(control):
            case schema.Slider() | schema.Select():
                for name in _FOREIGN:
                    if name in control.members:
                        message = f"`{name}` acts on a simulation, and this lab has none"
                        help = "a control has a name in formulas: `param`"
                        place = control.members[name].key.span
                        yield diagnose("field-unknown", place, message, help=help)
            case None:
                pass
            case _:
                message, help = "a lab without an engine has no buttons", "use a slider or a select"
                yield diagnose("field-value", control.place("type"), message, help=help)
        for option in control.items("options"):
            if isinstance(option, ArrayNode) and isinstance(option.items[-1], StringNode):
                message = "the value of an option is a number here"
                yield diagnose("field-type", option.items[-1].mark, message)
        yield from _check_units(control)
    controls = relations.known_controls(node, structs)
    goal = node.object("goal")
    for owner in (*node.objects("expect"), goal):
        after = owner.get("after")
        if isinstance(after, ObjectNode) and (after.members or owner is goal):
            yield from relations.check_steps(after, "after", controls)


def _check_units(node: ObjectNode) -> Iterator[Diagnostic]:
    unit = node.get("unit")
    if isinstance(unit, StringNode):
        yield from check_unit(unit.excerpt)


class _Compiler:
    """Makes the data of a lab from fields that are right, and collects what is wrong with it."""

    def __init__(self, kind: str, node: ObjectNode, fields: schema.EquationLab) -> None:
        self.kind, self.node, self.fields = kind, node, fields
        self.diagnostics: list[Diagnostic] = []
        self.slots: dict[str, int] = {}
        self.varying: set[int] = set()
        """Slots whose values differ along the axis."""

    def compile(self) -> dict[str, Any]:
        node, fields = self.node, self.fields
        axis_name = "x" if isinstance(fields, schema.PlotLab) else "t"
        axis = fields.x if isinstance(fields, schema.PlotLab) else fields.t  # type: ignore[attr-defined]
        axis_data = self.axis(node.object(axis_name), axis, axis_name)
        axis_label = axis.label or axis.name or axis_name
        axis_label += f" ({axis.unit})" if axis.unit else ""
        state_nodes = node.object("states").members
        for member in state_nodes.values():
            self.declare(member.key.value, member.key.span)
        self.varying = set(self.slots.values())
        for control in node.objects("controls"):
            parameter = control.get("param")
            if isinstance(parameter, StringNode):
                self.declare(parameter.value, parameter.span)
        definitions = [
            self.definition(m.key, m.value) for m in node.object("where").members.values()
        ]
        states = [
            {
                "name": name,
                "start": self.start(m.value.get("start")),
                "rate": self.formula(m.value.get("rate")),
            }
            for name, m in state_nodes.items()
            if isinstance(m.value, ObjectNode)
        ]
        plots = [
            self.plot(n, p, axis_label)
            for n, p in zip(node.objects("plots"), fields.plots, strict=True)
        ] or [self.plot_of_states(list(state_nodes), axis_label)]
        controls = [control_data(control) for control in fields.controls]
        return {
            "kind": self.kind,
            "title": fields.title,
            "height": fields.height,
            "axis": axis_data,
            "play": fields.play,
            "controls": controls,
            "where": definitions,
            "states": states,
            "events": [self.event(event, set(state_nodes)) for event in node.objects("events")],
            "plots": plots,
            "readouts": [
                {"label": r.label, "digits": r.digits, "value": self.formula(n.get("expr"))}
                for n, r in zip(node.objects("readouts"), fields.readouts, strict=True)
            ],
            "goal": self.goal(controls),
            "expect": [self.claim(n, controls) for n in node.objects("expect")],
            "verify": to_builtins(fields.verify or schema.Tolerance()),
        }

    def report(self, rule: str, span: Span, message: str, help: str = "") -> None:
        self.diagnostics.append(diagnose(rule, span, message, help=help))

    # --- names

    def declare(self, name: str, span: Span) -> int:
        key = normalise_name(name)
        if not key.isidentifier() or iskeyword(key):
            help = "a name has letters, digits and `_`, and no digit first"
            self.report("field-value", span, f"`{name}` cannot be a name in formulas", help)
        elif key in ARITIES or key in CONSTANTS:
            kind = "a function" if key in ARITIES else "a constant"
            self.report("field-value", span, f"`{name}` is {kind} of formulas already")
        elif key in self.slots:
            self.report("field-value", span, f"two things are called `{name}`")
            key = f"{key} {len(self.slots)}"  # so that what follows keeps its slot
        return self.slots.setdefault(key, len(self.slots))

    def axis(self, node: ObjectNode, axis: schema.Axis, name: str) -> dict[str, Any]:
        self.diagnostics += _check_units(node)
        name_node = node.get("name")
        self.declare(axis.name or name, node.mark if name_node is None else name_node.span)
        at = axis.min if axis.at is None else axis.at
        if not axis.min < axis.max or not math.isfinite(axis.max - axis.min):
            message = f"`max` must be greater than `min`, which is {axis.min:g}"
            self.report("field-value", node.place("max"), message)
        elif not axis.min <= at <= axis.max:
            message = f"`at` must lie between `min` and `max`: {axis.min:g} to {axis.max:g}"
            self.report("field-value", node.place("at"), message)
        elif (
            (verify := self.fields.verify) and verify.until is not None and verify.until <= axis.min
        ):
            message = f"`until` must be greater than `min`, which is {axis.min:g}"
            place = self.node.object("verify").place("until")
            self.report("field-value", place, message)
        data: dict[str, Any] = to_builtins(axis)
        return data | {"name": axis.name or name, "at": at}

    def definition(self, key: StringNode, value: Node) -> Program:
        program = self.formula(value)
        slot = self.declare(key.value, key.span)
        if not self.varying.isdisjoint(_slots(program)):
            self.varying.add(slot)
        return program

    # --- formulas

    def formula(self, node: Node | None) -> Program:
        if isinstance(node, NumberNode):
            return [float(node.value)]
        if not isinstance(node, StringNode):
            return [0.0]
        compilation = compile_formula(node.excerpt, self.slots)
        self.diagnostics += compilation.diagnostics
        return compilation.value or [0.0]

    def start(self, node: Node | None) -> Program:
        program = self.formula(node)
        if node is not None and not self.varying.isdisjoint(_slots(program)):
            message = "what a state starts from cannot depend on the time or on states"
            help = "use numbers, controls and definitions of `where` that depend on neither"
            self.report("field-value", node.mark, message, help)
        return program

    def event(self, node: ObjectNode, states: set[str]) -> dict[str, Any]:
        condition, stop, direction = node.get("when"), node.get("stop"), 0
        program: Program = [0.0]
        if isinstance(condition, StringNode):
            compilation = compile_condition(condition.excerpt, self.slots)
            self.diagnostics += compilation.diagnostics
            program, direction = compilation.value or ([0.0], 0)
        new = []
        for name, member in node.object("set").members.items():
            if name not in states:
                help = did_you_mean(name, states)
                self.report("lab-name", member.key.span, f"there is no state `{name}`", help)
            else:
                new.append([self.slots[normalise_name(name)], self.formula(member.value)])
        is_end = getattr(stop, "value", False)
        if not node.object("set").members and not is_end:
            help = "give states new values by `set`, or end the run by `stop`"
            self.report("field-missing", node.mark, "nothing happens at this event", help)
        end: Program | None = self.formula(stop) if isinstance(is_end, str) else None
        end = [1.0] if is_end is True else end
        return {"when": program, "direction": direction, "set": new, "stop": end}

    # --- what is shown, and what is claimed

    def plot(self, node: ObjectNode, plot: schema.EquationPlot, axis_label: str) -> dict[str, Any]:
        traces: list[dict[str, Any]] = [
            {"label": trace.label, "dash": trace.dash, "value": self.formula(n.get("expr"))}
            for n, trace in zip(node.objects("traces"), plot.traces, strict=True)
        ]
        horizontal = None if plot.x is None else self.formula(node.get("x"))
        field = None
        if plot.field:
            formulas: list[Program] = [horizontal or [], traces[0]["value"]]
            slots = [slot for formula in formulas for slot in _slots(formula[:1])]
            states = range(1, 1 + len(self.node.object("states").members))
            if all(len(formula) == 1 for formula in formulas) and set(slots) <= set(states):
                field = slots
            else:
                message = "`field` needs a plane of two states"
                help = "`x` is the name of one, and the `expr` of the first trace that of the other"
                self.report("field-value", node.place("field"), message, help)
        data: dict[str, Any] = to_builtins(plot)
        label = plot.xlabel or (axis_label if plot.x is None else plot.x)
        return data | {"xlabel": label, "x": horizontal, "traces": traces, "field": field}

    def plot_of_states(self, names: list[str], axis_label: str) -> dict[str, Any]:
        traces = tuple(schema.TraceFields(name, name) for name in names) or (
            schema.TraceFields("", "0"),
        )
        data: dict[str, Any] = to_builtins(schema.EquationPlot(traces))
        lines = [
            {"label": name, "dash": False, "value": [[self.slots.get(normalise_name(name), 0)]]}
            for name in names
        ]
        return data | {"xlabel": axis_label, "traces": lines, "field": None}

    def goal(self, controls: list[dict[str, Any]]) -> dict[str, Any] | None:
        goal, node = self.fields.goal, self.node.get("goal")
        if goal is None or not isinstance(node, ObjectNode):
            return None
        value, values = self.formula(node.get("expr")), _values(controls, goal.after)
        return {"hold": goal.hold, "value": value, "values": values}

    def claim(self, node: ObjectNode, controls: list[dict[str, Any]]) -> dict[str, Any]:
        claim = self.fields.expect[self.node.objects("expect").index(node)]
        self.diagnostics += relations.check_claim(node, claim)
        value = None if claim.expr is None else self.formula(node.get("expr"))
        data: dict[str, Any] = to_builtins(claim)
        return data | {"value": value, "values": _values(controls, claim.after)}


def _slots(program: Program) -> set[int]:
    return {item[0] for item in program if isinstance(item, list)}


def _values(controls: list[dict[str, Any]], after: Mapping[str, Any]) -> list[Any]:
    return [after.get(control["label"], control["value"]) for control in controls]
