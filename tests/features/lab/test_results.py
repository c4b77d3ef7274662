"""Results of labs: the verdict on a trial, what is kept of it, and how it is shown."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from coursebuild.core.files.resources import template_texts
from coursebuild.core.pages.materials import strings_for
from coursebuild.core.run.script_environment import engine_version
from coursebuild.features.lab.relations import is_editable
from coursebuild.features.lab.reply import (
    Attempt,
    Parity,
    TrialFailure,
    TrialReply,
    read_reply,
    reply_bytes,
)
from coursebuild.features.lab.verdict import failure_diagnostics
from support.fixture_cases import fixture_text
from support.lab_lessons import RIGHT, course, fence, run_check
from support.lab_values import BALL, lab_of, make_lab
from support.model_files import read_moving_png
from support.scratch_course import Folder

RESETS = '{"model": "ball",\n"setup": "ctx.n = (ctx.n ?? 0) + 1; data.qvel[1] = ctx.n"}'


STILL_MODEL = """<!-- Copyright: nobody. --><!-- A box that nothing
moves. --><mujoco><worldbody><geom type="box" size=".1 .1 .1"/></worldbody></mujoco>"""
DIVERGING_MODEL = """<mujoco><option timestep="1"/><worldbody><body>
<joint type="slide" stiffness="1e6"/><geom size=".1"/></body></worldbody>
<keyframe><key qpos="1"/></keyframe></mujoco>"""
"""It diverges."""


class BuiltSite(NamedTuple):
    """A course with a lab in which everything holds, and one whose reset leads elsewhere."""

    folder: Folder
    report: dict[str, Any]

    @property
    def public(self) -> Path:
        return self.folder.root / "public"

    def page(self, lesson: str) -> str:
        (page,) = (self.public / "lessons").glob(f"{lesson}-*.html")
        return page.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> BuiltSite:
    root = tmp_path_factory.mktemp("built") / "course"
    folder = course(root, stores, "## A lab\n\n" + fence(RIGHT), "## A\n\n" + fence(RESETS))
    folder.write("models/a/still.xml", STILL_MODEL)
    folder.write("models/lost.xml", DIVERGING_MODEL)
    report = run_check(folder, status=0)
    folder.main("build").require_success()
    return BuiltSite(folder, report)


@pytest.mark.engine
def test_a_lab_in_which_everything_holds(site: BuiltSite) -> None:
    lab, _ = site.report["labs"]
    assert {k: lab[k] for k in ("name", "title", "lesson", "status", "tried", "cached")} == {
        "name": "1.2-lab-1", "title": "All of it", "lesson": "1.2", "status": "ok",
        "tried": 1 + 3 + 3 + 2 + 1 + 6, "cached": False,
    }  # fmt: skip
    assert lab["parity"] == "bit-identical to native MuJoCo over 500 steps"
    assert lab["steps_per_second"] > 100
    text = site.folder.main("check", "1.2").out
    assert re.search(
        r"^ok       1\.2-lab-1  [\d,]+ steps/s, 16 things tried, "
        r"bit-identical to native MuJoCo over 500 steps, Play moves [\d.]+ %, "
        r"motion fills [\d.]+ %, "
        r"no Python export: a call of `lib\.random` has no counterpart in Python, cached$",
        text,
        re.MULTILINE,
    )
    assert "1 lab tried" in text


@pytest.mark.engine
def test_a_lab_whose_reset_leads_elsewhere_is_warned_of_and_published(site: BuiltSite) -> None:
    second_report = run_check(site.folder, status=0)
    for report, is_cached in ((site.report, False), (second_report, True)):
        (diagnostic,) = report["diagnostics"]
        fields = [diagnostic[name] for name in ("rule", "severity", "line")]
        assert fields == ["lab-reset", "warning", 5]
        assert [(lab["status"], lab["cached"]) for lab in report["labs"]] == [("ok", is_cached)] * 2
    assert '<div class="lab-static">' in site.page("1.3")
    only = run_check(site.folder, "1.3")
    assert [lab["name"] for lab in only["labs"]] == ["1.3-lab-1"]


@pytest.mark.engine
def test_a_page_shows_what_the_trial_recorded(site: BuiltSite) -> None:
    text = site.page("1.2")
    assert text.count('<svg class="lab-plot"') == 1
    assert "<dt>state</dt><dd>late</dd>" in text
    assert "bit-identical to native MuJoCo over 500 steps" in text
    assert len(list(site.public.glob("assets/labs/1.2-lab-1.*.png"))) == 1


@pytest.mark.engine
def test_what_falls_through_the_floor_is_told_in_the_labs_line(
    tmp_path: Path, stores: Path
) -> None:
    folder = course(tmp_path / "course", stores, "## A lab\n\n" + fence('{"model": "ball"}'))
    plane = '<worldbody><geom type="plane" size="1 1 .1" conaffinity="0" contype="2"/>'
    folder.write("models/ball.xml", BALL.replace("<worldbody>", plane))
    (line,) = run_check(folder, status=0)["labs"]
    assert line["fallen"] == ["`ball`, to z = -123 m at t = 5 s"]
    assert "falls out of the scene: `ball`, to z" in folder.main("check").out
    folder.write("models/ball.xml", BALL)
    (line,) = run_check(folder, status=0)["labs"]
    assert line["fallen"] == []


@pytest.mark.engine
def test_curve_that_leaves_its_plot_is_told_in_the_labs_line(tmp_path: Path, stores: Path) -> None:
    plot = (
        '{"ymin": -5, "ymax": 1, "x": "data.time - 9", "traces": ['
        '{"label": "height", "expr": "data.qpos[2]"},'
        ' {"label": "none", "expr": "null"}, {"label": "still", "expr": "1.0001"}]}'
    )
    curve = """
```lab plot
title = "A curve"
x = { name = "x", max = 2 }
plots = [{ ymax = 3, traces = [{ label = "square", expr = "x**2" }] }]
```
"""
    high = '{"ymax": 1, "traces": [{"label": "high", "expr": "3"}]}'
    lab = fence(f'{{"model": "ball", "stopAt": 2, "plots": [{plot}, {high}]}}')
    folder = course(tmp_path / "course", stores, f"## Labs\n\n{lab}{curve}")
    folder.write("models/ball.xml", BALL)
    clipped = {line["name"]: line["clipped"] for line in run_check(folder, status=0)["labs"]}
    assert clipped == {
        "1.2-lab-1": ["`height`, down to -19.6 (`ymin` is -5)", "`high`, up to 3 (`ymax` is 1)"],
        "1.2-lab-2": ["`square`, up to 4 (`ymax` is 3)"],
    }
    assert "leaves its plot: `height`, down to -19.6" in folder.main("check").out


@pytest.mark.engine
def test_models_are_live_on_their_pages_and_seen_in_the_gallery(site: BuiltSite) -> None:
    models = site.public / "models"
    for name, lab in (("ball", "1.2-lab-1"), ("a/still", "model-a-still"), ("lost", "model-lost")):
        page = (models / f"{name}.html").read_text("utf-8")
        assert page.index(f'data-lab="{lab}"') < page.index('id="used"') < page.index('id="facts"')
        assert re.search(rf'<img src="[./]+assets/labs/{lab}\.\w+\.png"', page), name
    gallery = (models / "index.html").read_text("utf-8")
    assert gallery.count('<img src="../assets/labs/') == 3
    assert "<p>A box that nothing moves.</p>" in gallery


@pytest.mark.engine
def test_model_of_a_lab_is_published_for_the_editor_if_it_is_one_file(
    site: BuiltSite,
) -> None:
    (address,) = site.public.glob("assets/labs/model-a-still.*.json")
    source = json.loads(address.read_text("utf-8"))["source"]
    assert (address.parent / source).read_text("utf-8") == STILL_MODEL
    assert is_editable(STILL_MODEL)
    for model in ('<include file="arm.xml"/>', '<texture fileright="r.png"/>', " " * 100_001):
        assert not is_editable(model)


LINES = fixture_text("documents/lab_lines.json").replace("BALL", BALL)

PLACES = [
    ((), "```lab simlab"),
    (("stopAt",), "2"),
    (("controller",), '"ctx.b = 1"'),
    (("controls", 0), '"model.body_mass[1]"'),
    (("controls", 1), '"ctx.size = value"'),
    (("controls", 2), '"data.qvel[0] = 1"'),
    (("controls", 3), '"gain"'),
    (("readouts", 0, "expr"), '"data.qpos[0]"'),
    (("readouts", 1, "expr"), '"data.qpos[1]"'),
    (("plots", 0, "traces", 1, "expr"), '"2"'),
    (("plots", 0, "traces", 1), "{"),
    (("expect", 0), '"data.time"'),
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


def test_lab_inside_a_quiz_has_places_too() -> None:
    sim = {"xml": BALL, "readouts": [{"label": "x", "expr": "nope"}]}
    question = {"kind": "predict", "q": "Which?", "options": ["a", "b"], "answer": 0, "sim": sim}
    quiz = json.dumps({"id": "q", "questions": [question]}, indent=1)
    text = f"```quiz\n{quiz}\n```\n"
    lab = lab_of(text)
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
    reply = TrialReply(engine_version(), (), failures, None)
    diagnostics = failure_diagnostics(make_lab(LINES), reply)
    assert [d.rule for d in diagnostics] == ["lab-diverged", "lab-warning", "lab-throws"]


def test_parity_in_words() -> None:
    english = strings_for(template_texts(), "en")
    whole = "bit-identical to native MuJoCo"
    for first, relative, text in (
        (None, 0.0, f"{whole} over 100 steps"),
        (31, 0.0, f"{whole} for 30 of 100 steps"),
        (31, 2.2e-12, f"{whole} for 30 of 100 steps, then within 2e-12"),
        (1, 2.2e-12, "within 2e-12 of native MuJoCo over 100 steps"),
    ):
        key, values = Parity(steps=100, first=first, relative=relative).describe()
        assert english(key, **values) == text


def test_difference_from_native_mujoco_is_allowed_as_the_lab_or_its_model_says() -> None:
    for relative, rtol, exact, expected in (
        (1e-10, None, False, True),
        (1e-8, None, False, False),
        (1e-8, 1e-7, False, True),
        (1e-8, 1e-8, False, True),
        (1e-16, 0.0, False, False),
        (0.0, 0.0, False, False),
        (0.0, None, False, True),
        (1e-16, None, True, False),
        (1e-16, 1e-12, True, True),
    ):
        parity = Parity(first=3, relative=relative, exact=exact)
        assert parity.is_within_tolerance(rtol) is expected, (relative, rtol, exact)
        assert Parity(exact=exact).is_within_tolerance(rtol)


def test_failure_without_a_message_is_told() -> None:
    reply = {
        "version": engine_version(),
        "tried": [{"entry": [], "what": "start"}],
        "failures": [{"entry": [], "kind": "throws", "at": None}],
        "main": None,
    }
    trial = read_reply(reply_bytes(reply))
    assert (trial.attempts, trial.steps_per_second) == ((Attempt("start"),), None)
    (diagnostic,) = failure_diagnostics(make_lab(LINES), trial)
    assert diagnostic.message == "the lab throws: something that has no text"


def test_what_only_the_browsers_engine_says_of_an_edited_model_is_told_at_its_line() -> None:
    lab = lab_of('```lab mjcf\n<mujoco>\n  <include file="part.xml"/>\n</mujoco>\n```\n')
    message = "XML Error: Error opening file 'part.xml'\nElement 'include', line 2\n\n"
    failure = TrialFailure((), "engine", message, None, Attempt("start"))
    (diagnostic,) = failure_diagnostics(lab, TrialReply(engine_version(), (), (failure,), None))
    assert (diagnostic.rule, diagnostic.span.text) == ("lab-engine", '<include file="part.xml"/>')
    wording = "the browser's engine says: error opening file 'part.xml' in <include>"
    assert diagnostic.message == wording
    assert "beside which there are no files" in diagnostic.help


@pytest.mark.engine
def test_a_path_shows_the_film_of_its_lab_where_motion_is_welcome(
    tmp_path: Path, stores: Path
) -> None:
    lab = fence('{"model": "ball", "height": 240, "film": 1.5, "verify": {"seconds": 1.5}}')
    folder = course(tmp_path / "course", stores, "## A lab\n\n" + lab)
    path = '[[path]]\ntitle = "Falling"\nlessons = ["1.2"]\n\n'
    folder.replace("content/course.toml", "[[level]]", f"{path}[[level]]")
    folder.main("build").require_success()
    (file,) = (tmp_path / "course/public").glob("assets/labs/1.2-lab-1-film.*.png")
    home = (tmp_path / "course/public/index.html").read_text("utf-8")
    media = "(prefers-reduced-motion: no-preference)"
    assert f'<source srcset="assets/labs/{file.name}" media="{media}">' in home
    frames, durations, rounds = read_moving_png(file.read_bytes())
    assert (len(frames), durations, rounds) == (15, {100}, 2)
    assert {frame.shape for frame in frames} == {(160, 320, 4)}
    places = [np.flatnonzero((f[..., 3] == 255).any(axis=1)).mean() for f in frames]
    assert places == sorted(places) and places[-1] > places[0] + 20, "the ball falls"
