"""Names in inline code: which are looked up, what is known, and where pages link to."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

import pytest

from coursebuild.core.run.script_environment import engine_version
from support.fixture_cases import fixture_text
from support.scratch_course import Folder, block

MakeCourse = Callable[..., Folder]

SCRIPT = fixture_text("scripts/names.py.txt")
KNOWN = fixture_text("documents/known_names.md")
NO_CLAIMS = """
`damping`, `page.blocks`, `reader.add("x_y")`, `pip install --user x`, `x = 1`, `a.b.c`,
`COURSE_KEY`, `draw(x)`, `i.e.`, `1e-3`, `m/s`, `kg m^2`, `_toc.yml`, `plot.svg`, `3.14.0`, `*`,
`"a_b"`, `f(`, `<x@y.org>`, `--delay-updates`, `a -> b`
"""
WRONG = fixture_text("documents/wrong_names.md")
OF_OTHERS = fixture_text("documents/names_of_others.md")
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


@pytest.mark.site
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
