"""Labs before they run: all that the author wrote about them, and no button that does nothing."""

from __future__ import annotations

import json
from typing import Any

from support.rendered_course import Make


def lab(**fields: Any) -> str:
    return f"```lab simlab\n{json.dumps(fields)}\n```\n"


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
