"""Names in inline code: which are looked up, what is known, and where pages link to."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

import pytest

from coursebuild.core.run.script_environment import engine_version
from support.scratch_course import Folder, block

MakeCourse = Callable[..., Folder]

SCRIPT = block(
    "spin.py",
    """import json
import time

import mujoco
import numpy as np


def measure(height):
    ball_speed = np.sqrt(2 * 9.81 * height)
    return ball_speed


model = mujoco.MjModel.from_xml_string("<mujoco/>")
data = mujoco.MjData(model)
print(json.dumps({"fall_time": 1}))""",
    '{"fall_time": 1}',
)
KNOWN = """
`mujoco.mj_step(model, data, nstep=…)`, `mj_step`, `mjtJoint`, `mujoco.mjtJoint.mjJNT_HINGE`,
`MjSpec.from_file`, `data.body("x").xpos[2]`, `data.contact[0].solref`, `data->qpos`,
`mjModel.nq`, `model.opt.timestep`, `jnt_range`, `flg_local=1`, `spec.worldbody.add_body().pos`,
`mjData`, `efc_pos`, `while data.time < 1`, `model.body_pos[i] += 1`, `<joint damping="2"/>`,
`<visual><global>`, `</body>`, `solref="-1 -2"`, `<frame pos="0 0 1">`, `<div class="x">`,
`measure(2)`, `ball_speed`, `fall_time`, `np.linalg.norm(x)`, `json.dumps`, `time.sleep(1)`,
`len(x)`, `isinstance(x, int)`, `coursebuild check --strict`, `--quick`, `[verify] rtol`,
`[[silence]]`, `[de]`, `examples/spin.py`, `models/NAME.toml`, `free_name`{code}, `listed_one`
"""
NO_CLAIMS = """
`damping`, `page.blocks`, `reader.add("x_y")`, `pip install --user x`, `x = 1`, `a.b.c`,
`COURSE_KEY`, `draw(x)`, `i.e.`, `1e-3`, `m/s`, `kg m^2`, `_toc.yml`, `plot.svg`, `3.14.0`, `*`,
`"a_b"`, `f(`, `<x@y.org>`, `--delay-updates`, `a -> b`
"""
WRONG = """
- `data.qpoz`, `data.body("x").xpoz[2]`, `data.contact[0].solreff`, `model.opt.timestp`
- `mj_stp(model, data)`, `mujoco.mj_frwd(model)`, `mju_dott(a, b)`
- `<mujoco><worldbody><geon size="1"/><geom sise="1"/></worldbody></mujoco>`
- [`mesure(2)`](examples/spin.py), `coursebuild chek`, `coursebuild check --strct`
- `[verify] rtoll` in `content/course.toml`

| `mj_frward()` | **`mj_frward()`** |
| --- | --- |
| [`mj_frward()`](#names) | a[^n] |

[^n]: `mj_frward()`

> [!note] `mj_frward()`
> - `mj_frward()`

```quiz
{"id": "q", "questions": [{"id": "a", "kind": "mcq", "q": "`mj_frward()`?",
 "options": ["`mj_frward()`", "b"], "answer": 1, "explain": "`mj_frward()`",
 "hints": ["`mj_frward()`"]}]}
```
"""
OF_OTHERS = """
`mj_data`, `mj_stp`, `mjcb_control`, `viewer.opt.flags`, `modl.nq`, `mjtJoint.mjJNT_FRE`,
`MjSpec.from_fle`, `<joint dampng="2"/>`, `<geon/>`, `solreff="1"`, `mesure(2)`, `ball_sped`,
`np.linalg.nrm(x)`, `time.slep(1)`, `--strct`, `examples/spim.py`, `[verify] rtoll`, `Drop`ped,
`<mesh filename="a.stl"/>`, `mju_max(a, b)`, `mujoco.mjx.Modl`, `model.armature`
"""
"""Names of which nobody here knows all that there are."""


def named_mistakes(course: Folder) -> list[str]:
    """What `check` marks as unknown, in the order of the text."""
    report = json.loads(course.main("check", "--format", "json", "-q").out)
    diagnostics = report["diagnostics"]
    assert {d["rule"] for d in diagnostics} <= {"name-unknown"}, diagnostics
    lines = course.text(course.lesson()).split("\n")
    return [lines[d["line"] - 1][d["column"] - 1 : d["end_column"] - 1] for d in diagnostics]


def test_names_that_exist_and_words_that_claim_nothing_pass(make_course: MakeCourse) -> None:
    course = make_course(f"## Names\n{KNOWN}{NO_CLAIMS}\n{SCRIPT}")
    course.replace(
        "content/course.toml", "[course]\n", '[verify]\nnames = ["listed_*"]\n\n[course]\n'
    )
    assert named_mistakes(course) == []


def test_names_that_certainly_mean_nothing_are_reported_wherever_they_stand(
    make_course: MakeCourse,
) -> None:
    course = make_course(f"## Names\n{WRONG}\n{SCRIPT}")
    names = "qpoz xpoz solreff timestp mj_stp mj_frwd mju_dott geon sise mesure chek --strct rtoll"
    assert named_mistakes(course) == [*names.split(), *["mj_frward"] * 10]


def test_names_of_other_libraries_and_projects_pass(make_course: MakeCourse) -> None:
    script = SCRIPT.replace("model", "other")
    assert named_mistakes(make_course(f"## Names\n{OF_OTHERS}\n{script}")) == []


@pytest.mark.parametrize(
    "assignment",
    [
        "data = Table()",
        "data = mujoco.MjData(model); data = Table()",
        "for data in [Table()]: pass",
    ],
)
def test_a_variable_is_of_mujoco_only_where_scripts_make_it_nothing_else(
    make_course: MakeCourse, assignment: str
) -> None:
    table = (
        "import mujoco\n\n\nclass Table:\n    rows = [1]\n\n\n"
        'model = mujoco.MjModel.from_xml_string("<mujoco/>")\n'
        f"{assignment}\nprint(data.rows)"
    )
    text = "`data.head()` and `data.rows` are a table's, and `model.nqq` is nothing."
    course = make_course(f"## Names\n\n{text}\n\n{block('table.py', table, '[1]')}")
    assert named_mistakes(course) == ["nqq"]


@pytest.mark.site
def test_pages_link_names_to_what_explains_them(make_course: MakeCourse) -> None:
    text = """## Of `mj_step`

`mj_step` and [`mj_forward`](#of-mj_step), `data.qpos`, `<joint/>`, `damping`, `free_name`{code},
`<flag energy="enable"/>`, `ball_speed`, `examples/spin.py`.
"""
    course = make_course(f"{text}\n\n{SCRIPT}")
    assert course.main("build").status == 0
    page = course.text("public/lessons/1.1-one.html")
    links = re.findall(r'<a class="name" href="([^"]*)"><code>', page)
    manual = f"https://mujoco.readthedocs.io/en/{engine_version()}"
    assert links == [
        f"{manual}/APIreference/APIfunctions.html#mj-step",
        f"{manual}/APIreference/APItypes.html#mjdata",
        f"{manual}/XMLreference.html#body-joint",
        f"{manual}/XMLreference.html#option-flag",
        "#spin.L9",
        "../examples/spin.py",
    ]
