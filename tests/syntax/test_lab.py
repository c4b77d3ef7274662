"""`lab` fences: what they become, and everything that can be wrong in one."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.diagnostics import Parsed
from coursebuild.model import (
    Block,
    Inline,
    Lab,
    LabCamera,
    LabControl,
    LabExpect,
    LabPlot,
    LabReadout,
    LabTrace,
    Paragraph,
    Text,
)
from coursebuild.source import Excerpt, Source, Span
from coursebuild.syntax.document import parse_document
from coursebuild.syntax.lab import parse_lab


class Plain:
    """A parser of texts to which all is text."""

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        return Parsed((Paragraph(excerpt.span(), self.inlines(excerpt).value),))

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        return Parsed((Text(excerpt.span(), excerpt.text),))


def parse(body: str, kind: str = "simlab") -> Parsed[Lab | None]:
    """The lab whose JSON begins in the second line."""
    source = Source("content/lessons/4.2-x.md", f"```lab {kind}\n{body}\n```\n")
    span = source.span(0, len(source.text) - 1)
    start = source.text.index("\n") + 1
    inner = Excerpt.of_span(source.span(start, start + len(body)))
    return parse_lab(span, kind, source.span(7, 7 + len(kind)), inner, Plain())


def told(body: str, kind: str = "simlab") -> list[str]:
    return [
        f"{d.span.line}:{d.span.column}-{d.span.end_column} {d.rule}: {d.message}"
        + (f" [{d.help}]" if d.help else "")
        for d in parse(body, kind).diagnostics
    ]


def text_of(span: Span | None) -> str:
    assert span is not None
    return span.text


COMPLETE = r"""{
  "title": "The flip", "note": "Press *Play*.", "height": 240, "dock": true,
  "model": "tumbling_box", "key": "intermediate",
  "camera": {"azimuth": -70, "elevation": 20, "distance": 0.8, "target": [0, 0, 0.5]},
  "toggles": ["frames", "com"], "overlays": {"frames": true, "com": false},
  "forceScale": 0.01, "autoplay": true, "stopAt": 20,
  "setup": "data.qvel[4] = 6", "controller": "ctx.n += 1",
  "controls": [
    {"label": "mass", "unit": "kg", "min": 0.5, "max": 2, "step": 0.1, "value": 1, "digits": 1,
     "set": "model.body_mass[1]", "init": true},
    {"type": "slider", "label": "gain", "min": -1, "max": 1, "value": 0, "param": "gain"},
    {"type": "select", "label": "integrator", "options": [["RK4", 1], ["Euler", 0]], "value": 0,
     "apply": "model.opt.integrator = value", "reset": true},
    {"type": "select", "label": "mode", "options": [["slow", "s"], ["fast", "f"]], "param": "mode"},
    {"type": "button", "label": "Spin", "run": "data.qvel[4] = 6"}],
  "readouts": [{"label": "E (J)", "expr": "lib.energy().kinetic", "digits": 5},
               {"label": "n", "expr": "ctx.n"}],
  "plots": [{"ylabel": "ω", "window": 10, "ymin": -7, "ymax": 7, "height": 200,
    "refLines": [{"y": 6, "label": "start"}, {"y": 0}],
    "traces": [{"label": "x", "expr": "data.qvel[3]", "dash": [4, 2]},
               {"label": "y", "expr": "data.qvel[4]", "dash": true},
               {"label": "z", "expr": "data.qvel[5]"}]}],
  "trail": "tip",
  "expect": [{"after": "Spin", "t": 5, "expr": "lib.energy().kinetic", "min": 0.1, "max": 1},
             {"after": {"mass": 2, "mode": "f"}, "t": 0, "expr": "1", "min": 1},
             {"t": 1, "expr": "2", "max": 2},
             {"after": [{"mass": 2}, "Spin", {"mode": "f", "gain": 1}], "t": 0, "expr": "1",
              "min": 1}],
  "seed": 4294967295, "verify": {"seconds": 3, "rtol": 0}
}"""


def test_a_complete_lab() -> None:
    parsed = parse(COMPLETE)
    assert parsed.diagnostics == ()
    lab = parsed.value
    assert lab is not None
    assert lab.span.text == f"```lab simlab\n{COMPLETE}\n```"
    assert (lab.kind, lab.kind_span.text, lab.config) == ("simlab", "simlab", COMPLETE)
    assert (lab.title, lab.height, lab.dock) == ("The flip", 240, True)
    note = lab.note[0]
    assert isinstance(note, Paragraph) and note.span.text == "Press *Play*."
    assert (lab.model, text_of(lab.model_span), lab.xml) == ("tumbling_box", '"tumbling_box"', None)
    assert (lab.key, text_of(lab.key_span)) == ("intermediate", '"intermediate"')
    assert lab.camera == LabCamera(-70.0, 20.0, 0.8, (0.0, 0.0, 0.5))
    assert (lab.toggles, lab.overlays) == (("frames", "com"), ("frames",))
    assert (lab.force_scale, lab.autoplay, lab.stop_at) == (0.01, True, 20.0)
    assert (lab.setup, lab.controller) == ("data.qvel[4] = 6", "ctx.n += 1")
    mass, gain, integrator, mode, spin = lab.controls
    assert mass == LabControl(
        span=mass.span,
        kind="slider",
        label="mass",
        unit="kg",
        minimum=0.5,
        maximum=2.0,
        step=0.1,
        value=1.0,
        digits=1,
        options=(),
        set="model.body_mass[1]",
        apply=None,
        param=None,
        run=None,
        init=True,
        reset=False,
    )
    assert mass.span.line == 10 and mass.span.text.startswith('{"label": "mass"')
    assert (gain.kind, gain.param, gain.value, gain.step) == ("slider", "gain", 0.0, None)
    assert (integrator.kind, integrator.value, integrator.options, integrator.reset) == (
        "select",
        0.0,
        (("RK4", 1.0), ("Euler", 0.0)),
        True,
    )
    assert (mode.value, mode.options) == ("s", (("slow", "s"), ("fast", "f")))
    assert (spin.kind, spin.run, spin.value) == ("button", "data.qvel[4] = 6", None)
    assert [(r.label, r.expr, r.digits) for r in lab.readouts] == [
        ("E (J)", "lib.energy().kinetic", 5),
        ("n", "ctx.n", 3),
    ]
    assert isinstance(lab.readouts[0], LabReadout) and lab.readouts[1].span.line == 18
    (plot,) = lab.plots
    assert isinstance(plot, LabPlot)
    assert (plot.ylabel, plot.xlabel, plot.window, plot.ymin, plot.ymax, plot.height) == (
        "ω",
        "",
        10.0,
        -7.0,
        7.0,
        200,
    )
    assert plot.ref_lines == ((6.0, "start"), (0.0, ""))
    assert plot.traces[0] == LabTrace(plot.traces[0].span, "x", "data.qvel[3]", (4.0, 2.0))
    assert [trace.dash for trace in plot.traces] == [(4.0, 2.0), True, False]
    assert (lab.trail, text_of(lab.trail_span)) == ("tip", '"tip"')
    first, second, third, fourth = lab.expect
    assert first == LabExpect(first.span, ("Spin",), 5.0, "lib.energy().kinetic", 0.1, 1.0)
    assert second.after == ((("mass", 2.0), ("mode", "f")),)
    assert (third.after, third.minimum, third.maximum) == ((), None, 2.0)
    assert fourth.after == ((("mass", 2.0),), "Spin", (("mode", "f"), ("gain", 1.0)))
    assert (lab.seed, lab.verify_seconds, lab.verify_rtol) == (4294967295, 3.0, 0.0)


def test_the_least_that_a_lab_needs() -> None:
    lab = parse('{"model": "m"}').value
    assert lab is not None
    assert (lab.title, lab.note, lab.height, lab.dock, lab.key, lab.camera) == (
        "",
        (),
        320,
        False,
        None,
        None,
    )
    assert (lab.controls, lab.readouts, lab.plots, lab.expect) == ((), (), (), ())
    assert (lab.seed, lab.verify_seconds, lab.trail_span) == (None, None, None)
    assert parse('{"model": "m", "overlays": ["com"], "camera": {"azimuth": 1}}').diagnostics == ()


def test_the_lines_of_an_inline_model_have_places() -> None:
    lab = parse('{"xml": "<mujoco>\\n  <worldbody/>\\n</mujoco>"}').value
    assert lab is not None and lab.xml is not None
    rows = lab.xml.lines()
    assert [row.text for row in rows] == ["<mujoco>", "  <worldbody/>", "</mujoco>"]
    assert [row.span().text for row in rows] == ["<mujoco>", "  <worldbody/>", "</mujoco>"]


def test_of_another_kind_only_what_all_have_is_checked() -> None:
    body = '{"title": "T", "note": "N", "height": 100, "points": [[1, 2]], "model": 3}'
    parsed = parse(body, "graph")
    assert parsed.diagnostics == ()
    lab = parsed.value
    assert lab is not None
    assert (lab.kind, lab.config, lab.title, lab.height) == ("graph", body, "T", 100)
    assert len(lab.note) == 1
    assert (lab.model, lab.controls) == (None, ())
    assert told('{"title": 4, "points": [1,], "height": 5, "a": 1, "a": 2}', "graph") == [
        "2:11-12 field-type: `title` must be a string, not the number 4"
        ' [put it between quotes: `"4"`]',
        "2:26-27 json-syntax: a comma before `]` [remove the comma]",
        "2:40-41 field-value: `height` must be at least 80, not 5",
        "2:51-54 field-repeated: `a` is given twice",
    ]
    assert told("[]", "graph") == ["2:1-2 field-type: the lab must be an object, not an array"]


LAB = '{"model": "m", %s}'
SLIDER = LAB % '"controls": [{"label": "a", "min": 0, "max": 2, "value": 1, %s}]'
SELECT = LAB % '"controls": [{"type": "select", "label": "a", "options": %s, "set": "x"%s}]'
CLAIM = LAB % (
    '"controls": [{"label": "m", "min": 0, "max": 1, "value": 1, "set": "q"},'
    ' {"type": "button", "label": "Go", "run": "x"},'
    ' {"type": "select", "label": "int", "options": [["x", 1], ["y", "b"]], "set": "i"}],\n'
    '"expect": [{%s}]'
)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("", '1:1-14 json-syntax: the block is empty: a JSON object is expected'
         ' [write `{"field": value, …}`]'),
        ("{}", "2:1-2 field-missing: `model` or `xml` is missing"),
        ('{"model": null}', "2:1-2 field-missing: `model` or `xml` is missing"),
        ('{"modle": "m"}', "2:2-9 field-unknown: unknown field `modle` [did you mean `model`?]"),
        ('{"model": "m", "xml": "<mujoco/>"}',
         "2:16-21 field-value: `model` and `xml` exclude each other [leave one of them out]"),
        ('{"model": " "}', "2:11-14 field-value: `model` is empty"),
        (LAB % '"stop_at": 3',
         "2:16-25 field-unknown: unknown field `stop_at` [did you mean `stopAt`?]"),
        (LAB % '"stopAt": 0', "2:26-27 field-value: `stopAt` must be greater than 0, not 0"),
        (LAB % '"autoplay": 1',
         "2:28-29 field-type: `autoplay` must be `true` or `false`, not the number 1"),
        (LAB % '"height": 240.5',
         "2:26-31 field-type: `height` must be an integer, not the number 240.5"),
        (LAB % '"key": -1', "2:23-25 field-value: `key` must be at least 0, not -1"),
        (LAB % '"key": 0.5', "2:23-26 field-type: `key` must be an integer or a string,"
         ' not the number 0.5 [put it between quotes: `"0.5"`]'),
        (LAB % '"seed": -3', "2:24-26 field-value: `seed` must be at least 0, not -3"),
        (LAB % '"forceScale": -1',
         "2:30-32 field-value: `forceScale` must be greater than 0, not -1"),
        (LAB % '"verify": {"second": 3}',
         "2:27-35 field-unknown: unknown field `second` [did you mean `seconds`?]"),
        (LAB % '"camera": {"distance": 0}',
         "2:39-40 field-value: `distance` must be greater than 0, not 0"),
        (LAB % '"camera": {"target": [0, 1]}',
         "2:37-38 field-value: `target` needs 3 entries, and has 2"),
        (LAB % '"toggles": ["frame"]',
         "2:28-35 field-value: `toggles[0]` cannot be `frame` [did you mean `frames`?]"),
        (LAB % '"toggles": ["com", "com"]',
         "2:35-40 field-value: the overlay `com` is named twice"),
        (LAB % '"overlays": {"contact": true}',
         "2:29-38 field-unknown: unknown field `contact` [did you mean `contacts`?]"),
        (LAB % '"overlays": "com"', "2:28-33 field-type: `overlays` must be an array of strings"
         ' or an object, not a string [put it between brackets: `["com"]`]'),
        # controls
        (LAB % '"controls": {"label": "a"}', "2:28-29 field-type: `controls` must be an array of"
         ' objects, not an object [put it between brackets: `[{"label": "a"}]`]'),
        (LAB % '"controls": [{"type": "slide"}]',
         "2:38-45 field-value: `type` cannot be `slide` [did you mean `slider`?]"),
        (LAB % '"controls": [{"label": "a", "run": "x"}]', "2:29-30 field-missing: `type` is"
         ' missing [its fields are those of `"type": "button"`]'),
        (LAB % '"controls": [{"type": "button", "label": "a"}]', "2:29-30 field-missing:"
         " `run` is missing [`run`: statements run when it is pressed]"),
        (LAB % '"controls": [{"label": "a", "max": 2, "value": 1, "set": "x"}]',
         "2:29-30 field-missing: `min` is missing [`min`: the left end]"),
        (SLIDER % '"step": 0, "set": "x"',
         "2:84-85 field-value: `step` must be greater than 0, not 0"),
        (SLIDER % '"step": 3, "set": "x"',
         "2:84-85 field-value: `step` is larger than the range from `min` to `max`, 2"),
        (SLIDER % '"digits": 1',
         "2:29-30 field-missing: `set`, `apply` or `param` is missing"),
        (SLIDER % '"set": "x", "param": "y"',
         "2:88-95 field-value: `set` and `param` exclude each other [leave one of them out]"),
        (SLIDER % '"param": "a b"',
         "2:85-90 field-value: `param` cannot be `a b` [expected: a name of JavaScript]"),
        (LAB % '"controls": [{"label": "a", "min": 2, "max": 2, "value": 2, "set": "x"}]',
         "2:61-62 field-value: `max` must be greater than `min`, which is 2"),
        (LAB % '"controls": [{"label": "a", "min": 0, "max": 2, "value": 3, "set": "x"}]',
         "2:73-74 field-value: `value` must lie between `min` and `max`: 0 to 2"),
        (LAB % '"controls": [{"type": "button", "label": "a", "run": "x"},'
         ' {"type": "button", "label": "a", "run": "y"}]',
         "2:103-106 field-value: two controls are called `a`"),
        (SELECT % ("[]", ""), "2:73-74 field-value: `options` is empty"),
        (SELECT % ('["x"]', ""), "2:74-77 field-type: `options[0]` must be an array of 2 values,"
         " not a string"),
        (SELECT % ('[["x", 1], ["y"]]', ""), "2:84-85 field-value: `options[1]` needs 2 entries,"
         " and has 1"),
        (SELECT % ('[["x", true]]', ""), "2:80-84 field-type: `options[0][1]` must be a number or"
         " a string, not `true`"),
        (SELECT % ('[["x", 1], ["x", 2]]', ""), "2:85-88 field-value: two options are called `x`"),
        (SELECT % ('[["x", 1], ["y", 1.0]]', ""),
         "2:90-93 field-value: two options have the value `1`"),
        (SELECT % ('[["x", 1], ["y", 2]]', ', "value": "x"'), "2:116-119 field-value: `value`"
         " cannot be `x`: no option has this value"
         " [`x` is the label of an option whose value is `1`]"),
        (SELECT % ('[["x", 1], ["y", 2]]', ', "value": 3'), "2:116-117 field-value: `value`"
         " cannot be `3`: no option has this value [the options have `1`, `2`]"),
        (SELECT % ('[["x", 1]]', ', "min": 2'), '2:97-102 field-unknown: unknown field `min`'
         ' [it is a field of `"type": "slider"`]'),
        # readouts and plots
        (LAB % '"readouts": [{"label": "a"}]', "2:29-30 field-missing: `expr` is missing"
         " [`expr`: an expression that gives a number or a string]"),
        (LAB % '"readouts": [{"label": "a", "expr": "b", "digits": 99}]',
         "2:67-69 field-value: `digits` must be at most 15, not 99"),
        (LAB % '"plots": [{"traces": []}]', "2:37-38 field-value: `traces` is empty"),
        (LAB % '"plots": [{}]', "2:26-27 field-missing: `traces` is missing"),
        (LAB % '"plots": [{"ymin": 1, "ymax": 1, "traces": [{"label": "a", "expr": "b"}]}]',
         "2:46-47 field-value: `ymax` must be greater than `ymin`, which is 1"),
        (LAB % '"plots": [{"traces": [{"label": "a", "expr": "b", "dash": "x"}]}]',
         "2:74-77 field-type: `dash` must be `true` or `false` or an array of numbers,"
         " not a string"),
        (LAB % '"plots": [{"refLines": [{"label": "a"}], "traces":'
         ' [{"label": "a", "expr": "b"}]}]', "2:40-41 field-missing: `y` is missing"),
        # claims
        (CLAIM % '"expr": "1", "min": 1',
         "3:12-13 field-missing: `t` is missing [`t`: simulated time in seconds]"),
        (CLAIM % '"t": -1, "expr": "1", "min": 1',
         "3:18-20 field-value: `t` must be at least 0, not -1"),
        (CLAIM % '"t": 1, "expr": "1"', "3:12-13 field-missing: `min` or `max` is missing"),
        (CLAIM % '"t": 1, "expr": "1", "mim": 1',
         "3:34-39 field-unknown: unknown field `mim` [did you mean `min`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "max": 1',
         "3:51-52 field-value: `max` must be at least `min`, which is 2"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": "Goo"',
         "3:53-58 lab-name: the lab has no button `Goo` [did you mean `Go`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": "int"',
         '3:53-58 lab-name: `int` is no button [give the value that it is set to: `{"int": …}`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {}',
         "3:53-54 field-value: `after` names no control"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"mm": 1}',
         "3:54-58 lab-name: the lab has no control `mm` [did you mean `m`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"Go": 1}',
         '3:54-58 lab-name: `Go` is a button and has no value [write `"after": "Go"`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": 1, "Go": 1}',
         "3:62-66 lab-name: `Go` is a button and has no value"
         ' [press it in a step of its own, as in `"after": [{…}, "Go"]`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": 1.5}',
         "3:59-62 field-value: `m` goes from 0 to 1, and cannot be `1.5`"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"m": "x"}',
         "3:59-62 field-value: `m` is a slider: its value is a number"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"int": "q"}', "3:61-64 field-value:"
         " `int` cannot be `q`: no option has this value [the options have `1`, `b`]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": {"int": true}',
         "3:61-65 field-type: `int` must be a number or a string, not `true`"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": 3', "3:53-54 field-type: `after` must"
         ' be a string or an object or an array of strings or objects, not the number 3'
         ' [put it between quotes: `"3"`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": []',
         "3:53-54 field-value: `after` is empty"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": ["Go", ""]',
         "3:60-62 field-value: `after[1]` is empty"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": [{"m": 1}, ["Go"]]', "3:64-65 field-type:"
         " `after[1]` must be a string or an object, not an array"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": [{"m": 1}, "Goo"]',
         "3:64-69 lab-name: the lab has no button `Goo` [did you mean `Go`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": ["Go", {}]',
         "3:60-61 field-value: `after[1]` names no control"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": ["Go", {"mm": 1}]',
         "3:61-65 lab-name: the lab has no control `mm` [did you mean `m`?]"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": [{"Go": 1}, {"m": 1}]',
         '3:55-59 lab-name: `Go` is a button and has no value [write `"Go"`]'),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": [{"m": 0},\n{"m": 1.5}]',
         "4:7-10 field-value: `m` goes from 0 to 1, and cannot be `1.5`"),
        (CLAIM % '"t": 1, "expr": "1", "min": 2, "after": ["Go", {"int": null}]',
         "3:68-72 field-type: `int` must be a number or a string, not `null`"
         " [leave the field out]"),
    ],
)  # fmt: skip
def test_what_an_author_is_told(body: str, expected: str) -> None:
    assert told(body) == [expected]
    assert parse(body).value is None


def test_notes_point_at_the_first() -> None:
    (found,) = parse('{"model": "m", "xml": "<mujoco/>"}').diagnostics
    assert [(n.message, text_of(n.span)) for n in found.notes] == [
        ("the other one is here", '"model"')
    ]


def test_a_wrong_control_hides_nothing_else() -> None:
    body = LAB % (
        '"controls": [\n'
        '{"label": "a", "min": 0, "max": 1, "value": "x", "set": "q"},\n'
        '{"label": "b", "min": 3, "max": 1, "value": 2, "set": "q"},\n'
        '{"type": "button", "label": "a", "run": "x"}],\n'
        '"expect": [{"t": 1, "expr": "e", "min": 0, "after": {"a": 7}},\n'
        '{"t": 1, "expr": "e", "min": 0, "after": "c"}],\n'
        '"plots": [{"traces": [], "window": 0}]'
    )
    assert [line.split(" [")[0] for line in told(body)] == [
        "3:45-48 field-type: `value` must be a number, not a string",
        "4:33-34 field-value: `max` must be greater than `min`, which is 3",
        "5:29-32 field-value: two controls are called `a`",
        "6:54-57 lab-name: `a` is a button and has no value",
        "7:42-45 lab-name: the lab has no button `c`",
        "8:22-23 field-value: `traces` is empty",
        "8:36-37 field-value: `window` must be greater than 0, not 0",
    ]


def test_in_a_lesson() -> None:
    source = Source("content/lessons/4.2-x.md", f"## Lab\n\n```lab simlab\n{COMPLETE}\n```\n")
    parsed = parse_document(source, frozenset(), lesson=True)
    assert parsed.diagnostics == ()
    lab = parsed.value.blocks[1]
    assert isinstance(lab, Lab)
    assert lab.controls[0].span.line == 12


# ------------------------------------------------------------------------------------- properties


@settings(max_examples=300)
@given(st.data())
def test_a_mutation_is_never_too_much(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*'{}[],:"\\\n 0-1e', "null", "true", '"x":', '"min": 9,', "[[1]]"])
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 12)) :]
    for kind in ("simlab", "graph"):
        parsed = parse(mutated, kind)
        assert (parsed.value is None) == bool(parsed.diagnostics)
        orders = [d.order for d in parsed.diagnostics]
        assert orders == sorted(orders)


@settings(max_examples=300)
@given(st.data())
def test_any_value_in_any_place_is_taken_or_told(data: st.DataObject) -> None:
    """A field of the complete lab replaced by another value, at any depth."""
    value = json.loads(COMPLETE)
    place: object = value
    while isinstance(place, dict | list) and place:
        keys = sorted(place) if isinstance(place, dict) else range(len(place))
        key = data.draw(st.sampled_from(list(keys)))
        inner = place[key]  # type: ignore[index]
        if not isinstance(inner, dict | list) or not inner or data.draw(st.booleans()):
            new = data.draw(
                st.sampled_from([None, True, -1, 0, 1e300, 0.5, "", "Spin", [], {}, [[]], ["a"]])
            )
            place[key] = new  # type: ignore[index]
            break
        place = inner
    parsed = parse(json.dumps(value, ensure_ascii=False, indent=1))
    assert (parsed.value is None) == bool(parsed.diagnostics)
    if parsed.value is not None:
        for control in parsed.value.controls:
            if control.kind == "slider":
                assert control.minimum is not None and control.maximum is not None
                assert isinstance(control.value, float)
                assert control.minimum <= control.value <= control.maximum
