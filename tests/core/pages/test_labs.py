"""Labs before they run: all that the author wrote about them, and no button that does nothing."""

from __future__ import annotations

import json
import re
from typing import Any

from support.rendered_course import Make

FULL: dict[str, Any] = {
    "title": "A <lab>",
    "model": "box",
    "key": 0,
    "stopAt": 5,
    "note": "Press *play*.",
    "toggles": ["frames", "com"],
    "controls": [
        {"label": "mass", "unit": "kg", "min": 0.5, "max": 2, "step": 0.1, "value": 1, "digits": 1,
         "param": "m"},
        {"label": "tilt", "min": -1, "max": 1, "value": 0, "param": "tilt"},
        {"label": "integrator", "type": "select", "options": [["RK4", 1], ["Euler", 0]], "value": 0,
         "set": "model.opt.integrator"},
        {"label": "kick", "type": "button", "run": "data.qvel[0] = 1"},
    ],
    "readouts": [{"label": "energy (J)", "expr": "1", "digits": 3}],
    "plots": [{"ylabel": "height (m)", "traces": [{"label": "z", "expr": "1"}],
               "refLines": [{"y": -0.5, "label": "floor"}]}],
}  # fmt: skip


def lab(**fields: Any) -> str:
    return f"```lab simlab\n{json.dumps(fields)}\n```\n"


def test_a_lab_with_every_field_is_described_in_full(make: Make) -> None:
    assert make(lab(**FULL)).html() == (
        '<section class="lab" data-lab="" data-kind="simlab" data-model="box" '
        'aria-label="Lab: A &lt;lab&gt;">\n'
        '<p class="lab-title"><span class="lab-kind">Lab</span> A &lt;lab&gt;</p>\n'
        '<div class="lab-static">\n'
        '<p class="lab-what">A simulation of the model <a href="../models/box.html">box</a>. '
        "It starts from keyframe <code>start</code>. It stops at 5 s.</p>\n"
        '<div class="table" tabindex="0" role="group" aria-label="Controls">\n<table>\n'
        '<thead><tr><th scope="col">Control</th><th scope="col">Range</th></tr></thead>\n<tbody>\n'
        '<tr><th scope="row">mass</th><td>0.5 to 2 kg in steps of 0.1; initially 1.0 kg</td></tr>\n'
        '<tr><th scope="row">tilt</th><td>−1 to 1; initially 0</td></tr>\n'
        '<tr><th scope="row">integrator</th><td>RK4, Euler; initially Euler</td></tr>\n'
        '<tr><th scope="row">kick</th><td>button</td></tr>\n</tbody>\n</table>\n</div>\n'
        '<dl class="lab-shows">\n'
        "<div><dt>Shown while it runs</dt><dd>energy (J)</dd></div>\n"
        "<div><dt>height (m) against time (s)</dt><dd>z, floor (−0.5)</dd></div>\n"
        "<div><dt>Can be drawn into the picture</dt><dd>body frames, centres of mass</dd></div>\n"
        '</dl>\n</div>\n<div class="lab-note">\n<p>Press <em>play</em>.</p>\n</div>\n</section>\n'
    )


def test_a_bare_lab_has_no_empty_parts(make: Make) -> None:
    html = make(lab(xml="<mujoco/>")).html()
    assert html == (
        '<section class="lab" data-lab="" data-kind="simlab" aria-label="Lab: Simulation">\n'
        '<p class="lab-title"><span class="lab-kind">Lab</span> Simulation</p>\n'
        '<div class="lab-static">\n'
        '<p class="lab-what">A simulation of a model of its own.</p>\n</div>\n</section>\n'
    )


def test_a_keyframe_without_a_name_is_numbered(make: Make) -> None:
    assert "keyframe <code>1</code>" in make(lab(model="box", key=1)).html()
    assert "keyframe <code>mine</code>" in make(lab(model="box", key="mine")).html()


def test_a_lab_has_no_control_before_its_script_runs(make: Make) -> None:
    assert not re.search("<(input|button|select|canvas)", make(lab(**FULL)).html())
