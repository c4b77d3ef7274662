"""Diagnostics of trials: each at the line of its entry, in words that an author knows."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.model import document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.lab.compile import pieces
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.reply import TrialFailure, TrialReply, read_trial
from coursebuild.features.lab.verdict import (
    Parity,
    code_diagnostic,
    parity_diagnostics,
    reset_diagnostics,
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


@pytest.mark.parametrize(("entry", "text"), PLACES)
def test_every_entry_has_its_place(entry: tuple[str | int, ...], text: str) -> None:
    assert make_lab(LINES).place(entry).text == text


def test_lines_of_entries_in_json_over_many_lines() -> None:
    lab = make_lab(LINES)
    lines = {entry: lab.place(entry).line for entry, _ in PLACES}
    assert lines[()] == 3
    assert lines[("controller",)] == 9
    assert lines[("controls", 2, "run")] == 20
    assert lines[("plots", 0, "traces", 1, "expr")] == 31


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


FAILURES = [
    ("throws", ("setup",), "Error: no", 0.0, "lab-throws: `setup` throws: Error: no"),
    (
        "throws",
        ("controls", 2, "run"),
        "Error: no.",
        1.25,
        "lab-throws: the button `Kick` throws at t = 1.25 s: Error: no",
    ),
    (
        "nan",
        ("readouts", 1, "expr"),
        "is NaN",
        0.5,
        "lab-value: the readout `y` is NaN at t = 0.5 s",
    ),
    (
        "type",
        ("plots", 0, "traces", 1, "expr"),
        "gives null, not a number",
        0.5,
        "lab-value: the trace `two` gives null, not a number",
    ),
    ("warning", (), "badctrl: x", 0.002, "lab-warning: MuJoCo warns at t = 0.002 s: badctrl: x"),
    (
        "diverged",
        (),
        "qpos[0] is NaN",
        3.0,
        "lab-diverged: the simulation diverges at t = 3 s: qpos[0] is NaN",
    ),
    (
        "expect",
        ("expect", 0, "expr"),
        "is 0.5 at 1 s, less than 1",
        1.0,
        "lab-expect: the claim does not hold: `data.time` is 0.5 at 1 s, less than 1",
    ),
    ("stopAt", ("stopAt",), "it does not stop at 2 s", 3.0, "lab-expect: it does not stop at 2 s"),
    (
        "timeout",
        ("controls", 1),
        "did not finish in time",
        None,
        "lab-timeout: trying the control `size` takes too long",
    ),
    (
        "timeout",
        ("setup",),
        "ran for more than 1 s",
        None,
        "lab-timeout: `setup` ran for more than 1 s",
    ),
    ("timeout", (), "took more than 9 MiB", None, "lab-timeout: the lab took more than 9 MiB"),
    ("engine", (), "no: MuJoCo Error: x", None, "lab-engine: the browser's engine says: no: x"),
    ("unheard-of", (), "something", None, "lab-throws: something"),
]


@pytest.mark.parametrize(("kind", "entry", "message", "time", "wanted"), FAILURES)
def test_failures_in_words(
    kind: str, entry: tuple[str | int, ...], message: str, time: float | None, wanted: str
) -> None:
    failure = TrialFailure(entry, kind, message, time, "start")
    (told,) = trial_diagnostics(make_lab(LINES), TrialReply("3.14.0", (), (failure,), None, None))
    assert f"{told.rule}: {told.message}" == wanted


def test_what_was_tried_is_said_beside_the_place() -> None:
    trial = TrialReply(
        "", (), (TrialFailure(("setup",), "throws", "x", None, 'button "Kick"'),), None, None
    )
    (told,) = trial_diagnostics(make_lab(LINES), trial)
    assert told.label == 'while trying: button "Kick"'


def test_what_is_so_from_the_start_is_told_once() -> None:
    failures = (
        TrialFailure((), "diverged", "qpos[0] is NaN", 1.0, "start"),
        TrialFailure(("controls", 0), "diverged", "qpos[0] is NaN", 1.5, "a"),
        TrialFailure(("controls", 1), "warning", "badctrl", 1.5, "b"),
        TrialFailure(("controls", 2, "run"), "throws", "x", 1.5, "c"),
    )
    told = trial_diagnostics(make_lab(LINES), TrialReply("", (), failures, None, None))
    assert [d.rule for d in told] == ["lab-diverged", "lab-warning", "lab-throws"]


def test_code_that_does_not_parse() -> None:
    lab = make_lab(LINES)
    by_entry = {piece.entry: piece for piece in pieces(lab)}
    told = code_diagnostic(lab, by_entry[("controls", 2, "run")], "Unexpected token '}'")
    assert told.message == "the button `Kick` has code that cannot run: unexpected token '}'"
    assert (told.span.text, told.help) == ('"data.qvel[0] = 1"', "")


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

    @pytest.mark.parametrize(
        ("relative", "rtol", "fine"),
        [
            (1e-10, None, True),
            (1e-8, None, False),
            (1e-8, 1e-7, True),
            (1e-8, 1e-8, True),
            (1e-16, 0.0, False),
            (0.0, 0.0, False),
            (0.0, None, True),
            (1e300, None, False),
        ],
    )
    def test_how_much_is_allowed(self, relative: float, rtol: float | None, fine: bool) -> None:
        assert Parity(10, 0.01, 3, relative).within(rtol) is fine
        assert Parity(10, 0.01, None, 0.0).within(rtol)

    def test_without_the_c_library_not_a_bit_may_differ(self) -> None:
        assert not Parity(10, 0.01, 3, 1e-16, exact=True).within(None)
        assert Parity(10, 0.01, None, 0.0, exact=True).within(None)
        assert Parity(10, 0.01, 3, 1e-16, exact=True).within(1e-12)

    def test_too_much_is_told_with_step_time_and_size(self) -> None:
        (told,) = parity_diagnostics(make_lab(LINES), Parity(1000, 0.002, 251, 0.125))
        assert told.message == (
            "the browser's engine and native MuJoCo differ from step 251 on (t = 0.502 s), "
            "by up to 1.2e-01 of the state, where 1e-06 is allowed"
        )
        assert told.span.text == "1e-6"
        assert list(parity_diagnostics(make_lab(LINES), Parity(9, 0.1, 3, 1e-7))) == []


def test_a_reply_with_holes_is_read() -> None:
    reply = {
        "version": "3.14.0",
        "tried": [{"entry": [], "what": "start"}],
        "failures": [{"entry": [], "kind": "throws", "at": None}],
        "main": None,
    }
    trial = read_trial(reply)
    assert trial.tried == ("start",)
    assert trial.steps_per_second is None
    assert trial.failures == (TrialFailure((), "throws", "something that has no text", None, ""),)


RESETS = [
    (("controls", 0), '"model.body_mass[1]"', "the control `mass` is not applied again; give it"),
    (("setup",), '"ctx.a = 1"', "chance from `lib.random()`"),
    ((), "```lab simlab", "chance from `lib.random()`"),
]


@pytest.mark.parametrize(("entry", "place", "help"), RESETS)
def test_a_reset_that_leads_elsewhere(entry: tuple[str | int, ...], place: str, help: str) -> None:
    lab = make_lab(LINES)
    main = {"resetDiffers": {"what": "qvel[0]", "entry": list(entry)}}
    (found,) = reset_diagnostics(lab, TrialReply("3", (), (), main, None))
    assert found.rule == "lab-reset"
    assert found.message == "a reset does not lead back to the start: `qvel[0]` differs"
    assert found.span.text.startswith(place)
    assert (found.help or "").startswith(help)


@pytest.mark.parametrize("main", [None, {"resetDiffers": None}])
def test_a_reset_that_leads_back_is_no_matter(main: dict[str, None] | None) -> None:
    assert list(reset_diagnostics(make_lab(LINES), TrialReply("3", (), (), main, None))) == []
