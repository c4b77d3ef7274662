"""Whatever a reader of a lab could run into is found first; see also `fixtures/rules`."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.lab_lessons import BALL, CART, checked, fence
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.engine

# What is wrong, its rule, and the lab; `‸` stands where the message must point.
MISTAKES = [
    ("a readout that throws", "lab-throws",
     '{"model": "ball",\n "readouts": [{"label": "r",\n  "expr": ‸"lib.bodyPos(\'bell\')"}]}'),
    ("a readout that is infinite after a button", "lab-value",
     '{"model": "ball", "controls": [{"type": "button", "label": "b", "run": "ctx.d = 1"}],\n'
     '"readouts": [{"label": "r", "expr": ‸"ctx.d ? 1 / 0 : 0"}]}'),
    ("a trace that is a text", "lab-value",
     '{"model": "ball", "plots": [{"ylabel": "y",\n"traces": [{"label": "t", "expr": "1"},\n'
     '{"label": "u", "expr": ‸"\'text\'"}]}]}'),
    ("a trace that throws after a while", "lab-throws",
     '{"model": "ball", "plots": [{"ylabel": "y",\n"traces": [{"label": "t",\n'
     '"expr": ‸"sim.time > 0.3 ? null.x : 0"}]}]}'),
    ("a setter that cannot set", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n"set": ‸"ctx.none.x"}]}'),
    ("a control at its maximum", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 1) null.x"}]}'),
    ("a control at its minimum", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 0) null.x"}]}'),
    ("a control at its value", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 0.5) null.x"}]}'),
    ("an option", "lab-throws",
     '{"model": "ball", "controls": [{"type": "select", "label": "s",\n'
     '"options": [["A", "a"], ["B", "b"], ["C", 3]],\n"apply": ‸"if (value === 3) null.x"}]}'),
    ("stepping after a control was moved", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}],\n'
     '"controller": ‸"if (ctx.p > 0.9 && sim.time > 0.1) null.x"}'),
    ("a reset after a control was moved", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p", "reset": true}],\n'
     '"setup": ‸"if (ctx.p > 0.9) null.x"}'),
    ("a button that throws", "lab-throws",
     '{"model": "ball", "controls": [{"type": "button", "label": "fine", "run": "ctx.a = 1"},\n'
     '{"type": "button", "label": "b",\n"run": ‸"lib.bodyPos(9)"}]}'),
    ("a setup that throws", "lab-throws", '{"model": "ball",\n\n"setup": ‸"undeclared = 1"}'),
    ("a position that is no number", "lab-diverged",
     '{"model": "ball", "controls": [{"type": "button", "label": "b",\n'
     '"run": ‸"data.qpos[2] = 0 / 0"}]}'),
    ("a claim after a button", "lab-expect",
     '{"model": "ball", "controls": [{"type": "button", '
     '"label": "b", "run": "data.qvel[2] = 9"}],\n'
     '"expect": [{"after": "b", "t": 0.1, "min": 3,\n"expr": ‸"data.qpos[2]"}]}'),
    ("a claim with a control", "lab-expect",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}],\n'
     '"expect": [{"after": {"s": 0.25}, "t": 0.1, "max": 0.2,\n"expr": ‸"ctx.p"}]}'),
    ("a claim after a control and a button", "lab-expect",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}, {"type": "button",\n'
     '"label": "b", "run": "data.qvel[2] = ctx.p"}],\n'
     '"expect": [{"after": [{"s": 0.25}, "b"], "t": 0, "max": 0.25, "expr": "data.qvel[2]"},\n'
     '{"after": [{"s": 0.25}, "b"], "t": 0, "max": 0.2,\n"expr": ‸"data.qvel[2]"}]}'),
    ("a claim that is NaN", "lab-value",
     '{"model": "ball", "expect": [{"t": 0.1,\n"expr": ‸"0 / 0", "min": 0}]}'),
    ("a lab with its own model", "lab-throws",
     '{"xml": "<mujoco><worldbody><geom size=\'1\'/></worldbody></mujoco>",\n'
     '"readouts": [{"label": "r", "expr": ‸"null.x"}]}'),
    ("a lab of a quiz", "lab-throws",
     '```quiz\n{"id": "q", "questions": [{"kind": "predict", "q": "Which?",\n'
     '"options": ["a", "b"], "answer": 0,\n"sim": {"model": "ball",\n'
     '"readouts": [{"label": "r", "expr": ‸"null.x"}]}}]}\n```\n\n'),
]  # fmt: skip


def test_each_mistake_of_a_lab_is_found_at_its_place(tmp_path: Path, stores: Path) -> None:
    """All in one lesson, one lab each."""
    folder = Folder(tmp_path / "course")
    bodies = (body for _, _, body in MISTAKES)
    fences = (body if body.startswith("```") else fence(body) for body in bodies)
    lesson = "## Labs\n\n" + "".join(fences)
    folder.fill([GOOD, lesson.replace("‸", "")], stores)
    folder.write("models/ball.xml", BALL)
    folder.write("models/cart.xml", CART)
    report = checked(folder, status=1)
    assert [lab["status"] for lab in report["labs"]] == ["failed"] * len(MISTAKES)
    found = [(d["rule"], d["line"], d["column"]) for d in report["diagnostics"]]
    places = zip(MISTAKES, expected(lesson), strict=True)
    assert [title for (title, _, _), place in places if place not in found] == []
    assert len(found) == len(MISTAKES)


def expected(lesson: str) -> list[tuple[str, int, int]]:
    """Rule, line and column of each mistake."""
    places = []
    before = ""
    for (_, rule, _), part in zip(MISTAKES, lesson.split("‸"), strict=False):
        before += part
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        places.append((rule, line, column))
    return places
