"""Labs through the commands."""

from __future__ import annotations

import re

import pytest

from support.lab_lessons import RIGHT, Make, checked, course, fence

pytestmark = pytest.mark.engine


def test_a_lab_in_which_everything_holds(make: Make) -> None:
    folder = course(make, "## A lab\n\n" + fence(RIGHT))
    report = checked(folder, status=0)
    assert report["diagnostics"] == []
    (lab,) = report["labs"]
    assert {k: lab[k] for k in ("name", "title", "lesson", "status", "tried", "cached")} == {
        "name": "1.2-lab-1", "title": "All of it", "lesson": "1.2", "status": "ok",
        "tried": 1 + 3 + 3 + 2 + 1 + 6, "cached": False,
    }  # fmt: skip
    assert lab["parity"] == "bit-identical to native MuJoCo over 500 steps"
    assert lab["steps_per_second"] > 100
    text = folder.main("check").out
    assert re.search(
        r"^ok       1\.2-lab-1  [\d,]+ steps/s, 16 things tried, "
        r"bit-identical to native MuJoCo over 500 steps, cached$",
        text,
        re.MULTILINE,
    )
    assert "1 lab tried" in text


def test_a_lab_whose_reset_leads_elsewhere_is_warned_of_and_published(make: Make) -> None:
    lab = '{"model": "ball",\n"setup": "ctx.n = (ctx.n ?? 0) + 1; data.qvel[1] = ctx.n"}'
    folder = course(make, "## A\n\n" + fence(lab))
    for cached in (False, True):
        report = checked(folder, status=0)
        (found,) = report["diagnostics"]
        assert (found["rule"], found["severity"], found["line"]) == ("lab-reset", "warning", 5)
        assert [(made["status"], made["cached"]) for made in report["labs"]] == [("ok", cached)]
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    (page,) = (folder.root / "public/lessons").glob("1.2-*.html")
    assert '<div class="lab-static">' in page.read_text(encoding="utf-8")


def test_a_lab_of_a_quiz_is_tried_at_its_place(make: Make) -> None:
    quiz = (
        '```quiz\n{"id": "q", "questions": [{"kind": "predict", "q": "Which?",\n'
        '"options": ["a", "b"], "answer": 0,\n'
        '"sim": {"model": "ball",\n"readouts": [{"label": "r", "expr": "null.x"}]}}]}\n```\n'
    )
    report = checked(course(make, "## A quiz\n\n" + quiz), status=1)
    (found,) = report["diagnostics"]
    assert (found["rule"], found["line"], found["column"]) == ("lab-throws", 7, 37)
    assert [lab["status"] for lab in report["labs"]] == ["failed"]


def test_only_the_lessons_that_are_asked_for(make: Make) -> None:
    wrong = '{"model": "ball", "setup": "null.x"}'
    folder = course(make, "## A\n\n" + fence(wrong), "## B\n\n" + fence(RIGHT))
    assert [lab["name"] for lab in checked(folder, "1.3")["labs"]] == ["1.3-lab-1"]
    assert checked(folder, "1.1", status=0)["labs"] == []
    assert checked(folder, "1.2", status=1)["labs"][0]["name"] == "1.2-lab-1"


def test_a_model_that_does_not_compile_is_told_once(make: Make) -> None:
    folder = course(make, "## A\n\n" + fence('{"model": "ball"}'))
    folder.write("models/ball.xml", "<mujoco><nonsense/></mujoco>")
    report = checked(folder, status=1)
    assert [d["rule"] for d in report["diagnostics"]] == ["model-error"]


def test_a_build_shows_and_compresses(make: Make) -> None:
    import gzip

    import brotli

    folder = course(make, "## A lab\n\n" + fence(RIGHT))
    assert folder.main("build").status == 0
    public = folder.root / "public"
    page = next(public.glob("**/1.2*.html"), None) or next(
        p for p in public.rglob("*.html") if 'data-lab="1.2-lab-1"' in p.read_text()
    )
    text = page.read_text()
    assert text.count('<svg class="lab-plot"') == 1
    assert "<dt>state</dt><dd>late</dd>" in text
    assert "bit-identical to native MuJoCo over 500 steps" in text
    assert len(list(public.glob("assets/labs/1.2-lab-1.*.png"))) == 1
    found = (p for p in public.rglob("*") if p.suffix in (".br", ".gz"))
    copies = [p for p in found if "search" not in p.relative_to(public).parts]
    assert {p.name.split(".")[-2] for p in copies} == {"js", "css", "wasm", "json", "mjb"}
    for copy in copies:
        data = copy.read_bytes()
        plain = brotli.decompress(data) if copy.suffix == ".br" else gzip.decompress(data)
        assert plain == copy.with_suffix("").read_bytes()
        assert len(data) < len(plain)
        assert len(plain) >= 1024 and "assets" in copy.relative_to(public).parts
    whole = list(public.glob("assets/**/*.wasm"))
    assert len(whole) == 1 and whole[0].with_name(whole[0].name + ".br") in copies
