"""Diagnostics of trials: each at the line of its entry, in words that an author knows."""

from __future__ import annotations

import json

from coursebuild.core.model import document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.reply import (
    Attempt,
    TrialFailure,
    TrialReply,
    read_reply,
    reply_bytes,
)
from coursebuild.features.lab.verdict import (
    Parity,
    trial_diagnostics,
)
from coursebuild.features.quiz.model import Quiz
from support.lab_values import BALL, make_lab

LINES = """{
  "xml": "BALL",
  "stopAt": 2,
  "setup": "ctx.a = 1",
  "controller":
    "ctx.b = 1",
  "controls": [
    {"label": "mass", "min": 0, "max": 1, "value": 0,
     "set": "model.body_mass[1]"},
    {
      "label": "size",
      "min": 0, "max": 1, "value": 0,
      "apply": "ctx.size = value"
    },
    {"type": "button",
     "label": "Kick", "run":
       "data.qvel[0] = 1"},
    {"min": 0, "max": 1, "value": 0, "label": "gain",
     "param": "gain"}
  ],
  "readouts": [
    {"label": "x",
     "expr": "data.qpos[0]"}, {"label": "y", "expr": "data.qpos[1]"}
  ],
  "plots": [
    {"ylabel": "z", "traces": [{"label": "one", "expr": "1"},
      {"label": "two",
       "expr": "2"}]}
  ],
  "expect": [
    {"t": 1,
     "expr": "data.time", "min": 1}
  ],
  "verify": {"seconds": 1,
    "rtol": 1e-6}
}""".replace("BALL", BALL)

PLACES = [
    ((), "```lab simlab"),
    (("stopAt",), "2"),
    (("setup",), '"ctx.a = 1"'),
    (("controller",), '"ctx.b = 1"'),
    (("controls", 0), '"model.body_mass[1]"'),
    (("controls", 0, "set"), '"model.body_mass[1]"'),
    (("controls", 1), '"ctx.size = value"'),
    (("controls", 1, "apply"), '"ctx.size = value"'),
    (("controls", 2), '"data.qvel[0] = 1"'),
    (("controls", 2, "run"), '"data.qvel[0] = 1"'),
    (("controls", 3), '"gain"'),
    (("readouts", 0, "expr"), '"data.qpos[0]"'),
    (("readouts", 1, "expr"), '"data.qpos[1]"'),
    (("plots", 0, "traces", 0, "expr"), '"1"'),
    (("plots", 0, "traces", 1, "expr"), '"2"'),
    (("plots", 0, "traces", 1), "{"),
    (("expect", 0), '"data.time"'),
    (("expect", 0, "expr"), '"data.time"'),
    (("verify", "rtol"), "1e-6"),
    (("no", "such", 7), "```lab simlab"),
    (("controls", 99, "run"), "["),
]


def test_every_entry_has_its_place() -> None:
    lab = make_lab(LINES)
    assert {entry: lab.place(entry).text for entry, _ in PLACES} == dict(PLACES)
    lines = {(): 3, ("controller",): 9, ("controls", 2, "run"): 20}
    lines["plots", 0, "traces", 1, "expr"] = 31
    assert {entry: lab.place(entry).line for entry in lines} == lines


def test_a_lab_inside_a_quiz_has_places_too() -> None:
    quiz = {
        "id": "q",
        "questions": [
            {
                "kind": "predict",
                "q": "Which?",
                "options": ["a", "b"],
                "answer": 0,
                "sim": {"xml": BALL, "readouts": [{"label": "x", "expr": "nope"}]},
            }
        ],
    }
    text = f"```quiz\n{json.dumps(quiz, indent=1)}\n```\n"
    parsed = parse_document(Source("content/lessons/1.1-x.md", text), frozenset(), lesson=True)
    assert parsed.diagnostics == ()
    assert any(isinstance(block, Quiz) for block in parsed.value.blocks)
    (lab,) = (block for block in document_blocks(parsed.value) if isinstance(block, Lab))
    span = lab.place(("readouts", 0, "expr"))
    assert (span.text, span.line) == ('"nope"', text[: text.index('"nope"')].count("\n") + 1)
    assert lab.place(()).text == "{"


def test_what_is_so_from_the_start_is_told_once() -> None:
    failures = (
        TrialFailure((), "diverged", "qpos[0] is NaN", 1.0, Attempt("start")),
        TrialFailure(("controls", 0), "diverged", "qpos[0] is NaN", 1.5, Attempt("a")),
        TrialFailure(("controls", 1), "warning", "badctrl", 1.5, Attempt("b")),
        TrialFailure(("controls", 2, "run"), "throws", "x", 1.5, Attempt("c")),
    )
    told = trial_diagnostics(make_lab(LINES), TrialReply("", (), failures, None))
    assert [d.rule for d in told] == ["lab-diverged", "lab-warning", "lab-throws"]


class TestParity:
    def test_in_words(self) -> None:
        assert (
            Parity(100, 0.01, None, 0.0).describe()
            == "bit-identical to native MuJoCo over 100 steps"
        )
        assert Parity(100, 0.01, 31, 0.0).describe() == (
            "bit-identical to native MuJoCo for 30 of 100 steps"
        )
        assert Parity(100, 0.01, 31, 2.2e-12).describe() == (
            "bit-identical to native MuJoCo for 30 of 100 steps, then within 2e-12"
        )

    def test_how_much_is_allowed(self) -> None:
        for relative, rtol, fine in (
            (1e-10, None, True),
            (1e-8, None, False),
            (1e-8, 1e-7, True),
            (1e-8, 1e-8, True),
            (1e-16, 0.0, False),
            (0.0, 0.0, False),
            (0.0, None, True),
            (1e300, None, False),
        ):
            assert Parity(10, 0.01, 3, relative).within(rtol) is fine, (relative, rtol)
            assert Parity(10, 0.01, None, 0.0).within(rtol)

    def test_without_the_c_library_not_a_bit_may_differ(self) -> None:
        assert not Parity(10, 0.01, 3, 1e-16, exact=True).within(None)
        assert Parity(10, 0.01, None, 0.0, exact=True).within(None)
        assert Parity(10, 0.01, 3, 1e-16, exact=True).within(1e-12)


def test_a_reply_with_holes_is_read() -> None:
    reply = {
        "version": "3.14.0",
        "tried": [{"entry": [], "what": "start"}],
        "failures": [{"entry": [], "kind": "throws", "at": None}],
        "main": None,
    }
    trial = read_reply(reply_bytes(reply))
    assert trial.tried == (Attempt("start"),)
    assert trial.steps_per_second is None
    (told,) = trial_diagnostics(make_lab(LINES), trial)
    assert told.message == "the lab throws: something that has no text"


def test_what_only_the_browsers_engine_says_of_an_edited_model_is_told_at_its_line() -> None:
    text = '```lab mjcf\n<mujoco>\n  <include file="part.xml"/>\n</mujoco>\n```\n'
    parsed = parse_document(Source("content/lessons/4.2-x.md", text), frozenset(), lesson=True)
    (lab,) = parsed.value.blocks
    assert isinstance(lab, Lab)
    message = "XML Error: Error opening file 'part.xml'\nElement 'include', line 2\n\n"
    failure = TrialFailure((), "engine", message, None, Attempt("start"))
    (told,) = trial_diagnostics(lab, TrialReply("3.14.0", (), (failure,), None))
    assert (told.rule, told.span.text) == ("lab-engine", '<include file="part.xml"/>')
    said = "the browser's engine says: error opening file 'part.xml' in <include>"
    assert (told.message, "beside which there are no files" in told.help) == (said, True)
