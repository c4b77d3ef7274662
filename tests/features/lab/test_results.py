"""Labs through the commands: what a report says of them, and what a site shows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from support.lab_lessons import RIGHT, course, fence, run_check
from support.scratch_course import Folder

pytestmark = pytest.mark.engine

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
    build = folder.main("build")
    assert build.status == 0, build.out + build.err
    return BuiltSite(folder, report)


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
        r"bit-identical to native MuJoCo over 500 steps, motion fills 0\.2 %, "
        r"no Python export: a call of `lib\.random` has no counterpart in Python, cached$",
        text,
        re.MULTILINE,
    )
    assert "1 lab tried" in text


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


def test_a_page_shows_what_the_trial_recorded(site: BuiltSite) -> None:
    text = site.page("1.2")
    assert text.count('<svg class="lab-plot"') == 1
    assert "<dt>state</dt><dd>late</dd>" in text
    assert "bit-identical to native MuJoCo over 500 steps" in text
    assert len(list(site.public.glob("assets/labs/1.2-lab-1.*.png"))) == 1


def test_models_are_live_on_their_pages_and_seen_in_the_gallery(site: BuiltSite) -> None:
    models = site.public / "models"
    for name, lab in (("ball", "1.2-lab-1"), ("a/still", "model-a-still"), ("lost", "model-lost")):
        page = (models / f"{name}.html").read_text("utf-8")
        assert page.index(f'data-lab="{lab}"') < page.index('id="used"') < page.index('id="facts"')
        assert re.search(rf'<img src="[./]+assets/labs/{lab}\.\w+\.png"', page), name
    gallery = (models / "index.html").read_text("utf-8")
    assert gallery.count('<img src="../assets/labs/') == 3
    assert "<p>A box that nothing moves.</p>" in gallery
