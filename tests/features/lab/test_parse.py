"""`lab` fences: what they become."""

from __future__ import annotations

import json

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Paragraph
from coursebuild.features.lab.schema import (
    Button,
    Camera,
    Expect,
    Overlays,
    Select,
    SimLab,
    Slider,
    Verify,
)
from support.fixture_cases import fixture_text
from support.lab_values import lab_of
from support.text_cases import format_diagnostics
from support.text_cases import parse_lab as parse

COMPLETE = fixture_text("documents/complete_lab.json")


def test_a_complete_lab() -> None:
    parsed_lab = parse(COMPLETE)
    assert parsed_lab.diagnostics == ()
    lab = parsed_lab.value
    assert lab is not None
    assert lab.span.text == f"```lab simlab\n{COMPLETE}\n```"
    assert (lab.kind, lab.kind_span.text) == ("simlab", "simlab")
    assert (json.loads(lab.config), "\n" in lab.config) == (json.loads(COMPLETE), False)
    note = lab.note[0]
    assert isinstance(note, Paragraph) and note.span.text == "Press *Play*."
    assert (lab.xml, lab.models(), lab.fields.dock) == (None, ("tumbling_box",), True)
    fields = lab.fields
    assert fields.camera == Camera(-70.0, 20.0, 0.8, (0.0, 0.0, 0.5))
    assert fields.overlays == Overlays(frames=True)
    *sliders, integrator, mode, spin = fields.controls
    assert [isinstance(slider, Slider) and slider.start for slider in sliders] == [1.0, 0.0]
    assert isinstance(integrator, Select) and integrator.start == 0.0
    assert isinstance(mode, Select) and mode.start == "s"
    assert spin == Button("Spin", "data.qvel[4] = 6")
    assert [trace.dash for trace in fields.plots[0].traces] == [(4.0, 2.0), True, False]
    assert [claim.steps for claim in fields.expect] == [
        ("Spin",),
        ({"mass": 2.0, "mode": "f"},),
        (),
        ({"mass": 2.0}, "Spin", {"mode": "f", "gain": 1.0}),
    ]
    goal = fields.goal
    assert goal is not None and (goal.expr, goal.hold) == ("up", 2)
    assert [entry.do for entry in goal.log] == [{"gain": 1, "mass": 2}, "Spin"]
    assert [inline.span.text for inline in lab.child_inlines()] == ["Let it ", "*fly*", "."]
    assert (lab.verify.seconds, lab.verify.rtol, lab.verify.deep) == (3.0, 0.0, False)


def test_the_least_that_a_lab_needs() -> None:
    lab = parse('{"model": "m"}').value
    assert lab is not None
    assert (lab.note, lab.fields) == ((), SimLab(model="m"))
    assert (lab.fields.height, lab.fields.dock, lab.verify) == (300, False, Verify())
    assert parse('{"model": "m", "overlays": ["com"], "camera": {"azimuth": 1}}').diagnostics == ()


def messages(body: str, kind: str) -> list[str]:
    return format_diagnostics(parse(body, kind).diagnostics)


def test_of_another_kind_only_what_all_have_is_checked() -> None:
    body = '{"title": "T", "note": "N", "height": 100, "points": [[1, 2]], "model": 3}'
    parsed_lab = parse(body, "graph")
    assert parsed_lab.diagnostics == ()
    lab = parsed_lab.value
    assert lab is not None
    assert (lab.kind, lab.config, lab.fields) == ("graph", body, SimLab(title="T", height=100))
    assert len(lab.note) == 1
    assert messages('{"title": 4, "points": [1,], "height": 5, "a": 1, "a": 2}', "graph") == [
        "2:11-12 field-type: `title` must be a string, not the number 4"
        ' [put it between quotes: `"4"`]',
        "2:26-27 json-syntax: there is a comma before `]` [remove the comma]",
        "2:40-41 field-value: `height` must be at least 80, not 5",
        "2:51-54 field-repeated: `a` is given twice",
    ]
    assert messages("[]", "graph") == ["2:1-2 field-type: the lab must be an object, not an array"]


def test_a_model_that_readers_edit() -> None:
    head = 'lab mjcf title="A ball" height=100 seconds=2 rtol=1e-6 diverges=3 deep dock'
    lab = lab_of(f"> ```{head}\n> <mujoco/>\n> ```\n")
    assert lab.xml is not None
    fields = lab.fields
    assert (lab.kind, lab.xml.text, lab.xml.span().line) == ("mjcf", "<mujoco/>\n", 2)
    assert (fields.title, fields.height, lab.fields.dock) == ("A ball", 100, True)
    assert (lab.verify, fields.expect) == (Verify(2.0, 1e-6, True), (Expect(3.0, diverges=True),))
    diagnostics = parse("<mujoco/>", "mjcf height=\udc80").diagnostics
    assert "fence-key-value" in {diagnostic.rule for diagnostic in diagnostics}, "half a character"


@settings(max_examples=60)
@given(st.data())
def test_any_edit_of_a_good_text_is_read_or_told(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*'{}[],:"\\\n 0-1e', "null", "true", '"x":', '"min": 9,', "[[1]]"])
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 12)) :]
    for kind in ("simlab", "graph"):
        parsed_lab = parse(mutated, kind)
        assert (parsed_lab.value is None) == bool(parsed_lab.diagnostics)
        orders = [d.order for d in parsed_lab.diagnostics]
        assert orders == sorted(orders)


@settings(max_examples=60)
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
    parsed_lab = parse(json.dumps(value, ensure_ascii=False, indent=1))
    assert (parsed_lab.value is None) == bool(parsed_lab.diagnostics)
    if parsed_lab.value is not None:
        for control in parsed_lab.value.fields.controls:
            assert not isinstance(control, Slider) or control.min <= control.value <= control.max
