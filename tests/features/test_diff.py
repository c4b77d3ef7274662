"""`coursebuild diff`: the report of a change for its reviewers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from support.fixture_cases import check_text, fixture_text
from support.scratch_course import Folder
from support.workflows import commit, git

LAB = fixture_text("documents/diff_lab.md")
MODEL = """
<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size="%s"/></body></worldbody></mujoco>
"""
DRAW = "import pathlib\npathlib.Path('flip.svg').write_text('<svg/>')\nprint('drawn')"
TABLE = "Output:\n\n| n | error |\n| --- | --- |\n| 1 | 0.50 |\n| 2 | %s |\n\n"
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 50"><path d="M0 0H%s"/></svg>\n'
OLD = fixture_text("documents/diff_old.md")
NEW = fixture_text("documents/diff_new.md")
HERE = Path(__file__).parent


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "repository" / "a cöurse")
    folder.fill([OLD], stores)
    folder.write("models/ball.xml", MODEL % "0.1")
    folder.write("content/lessons/flip.svg", SVG % 50)
    folder.write(".gitignore", ".coursebuild\n")
    git(folder.root.parent, "init", "-q", "-b", "main")
    commit(folder.root)
    return folder


def change(course: Folder) -> None:
    entry = '[[level.lesson]]\nid = "1.2"\nslug = "two"\ntitle = "Two"\nstatus = "draft"\n'
    course.write("content/course.toml", course.text("content/course.toml") + entry)
    course.write(course.lesson(1), NEW)
    course.write(course.lesson(2), "## Two\n\nText.\n")
    course.write("models/ball.xml", MODEL % "0.2")
    course.write("content/lessons/flip.svg", SVG % 60)


def test_report_has_every_effect_of_a_change(
    course: Folder, tmp_path: Path, rewriting: bool
) -> None:
    shutil.copytree(course.root, tmp_path / "before")
    base = git(course.root, "rev-parse", "--short=7", "HEAD")
    git(course.root, "checkout", "-q", "-b", "change")
    change(course)
    result = course.main("diff", "main")
    assert (result.status, result.err) == (0, "")
    report = result.out.replace(f"`main` ({base})", "BASE")
    check_text(HERE / "diff.md", report, rewriting=rewriting)
    git(course.root, "checkout", "-q", "--detach", "main")  # main goes on, which is no change here
    git(course.root, "stash", "-q", "-u")
    course.write("models/other.xml", MODEL % "0.3")
    commit(course.root)
    git(course.root, "branch", "-q", "-f", "main", "HEAD")
    git(course.root, "checkout", "-q", "change")
    git(course.root, "stash", "pop", "-q")
    assert course.main("diff", "main").out == result.out
    assert course.main("diff", "../../before").out == report.replace("BASE", "`../../before`")
    assert not (course.root / "examples").exists(), "nothing was run"


def test_sandbox_runs_no_feature_and_says_so(course: Folder) -> None:
    plain = course.main("diff", "HEAD").out
    assert course.main("diff", "HEAD", "--sandbox").out == plain
    course.write("features/own.py", "open('ran', 'w')\n")
    map = course.text("content/course.toml")
    entry = '[course]\nfeatures = ["features/own.py"]\n'
    course.write("content/course.toml", map.replace("[course]\n", entry))
    result = course.main("diff", "HEAD", "--sandbox")
    assert (result.status, result.err) == (0, "")
    note = "Not run, so that what they tell is left out: `features/own.py`."
    assert result.out == f"{plain}\n### Features\n\n{note}\n"
    assert not (course.root / "ran").exists()


def test_report_without_changes(course: Folder) -> None:
    report = course.main("diff", "HEAD").out
    assert "Lessons and pages: no change.\n" in report
    assert report.count("\n\nNo change.\n") == 4


def site(course: Folder, name: str, **files: str) -> None:
    for path, text in files.items():
        course.write(f"{name}/{path.replace('__', '.')}", text)


def test_a_page_weighs_what_it_loads(course: Folder) -> None:
    page = '<!DOCTYPE html><link rel="stylesheet" href="s.css"><img src="p.png" alt=""><a href="x">'
    shared_files = {"other__html": "<p>" + 900 * "x", "s__css": 500 * "s"}
    site(
        course, "public", index__html=page, old__html=1000 * "o", p__png=1000 * "p", **shared_files
    )
    site(course, "preview", index__html=page, new__html="<p>", p__png=3000 * "p", **shared_files)
    sites = ("--base-site", "public", "--site", "preview")
    report = course.main("diff", "HEAD", *sites).out
    assert report.endswith(
        "| page | before | now | change |\n| --- | --- | --- | --- |\n"
        "| the whole site | 3.5 kB | 4.5 kB | +28.7% |\n"
        "| index.html | 1.6 kB | 3.6 kB | +126.0% |\n"
        "| old.html | 1.0 kB | 0.0 kB | removed |\n"
        "| new.html | 0.0 kB | 0.0 kB | new |\n"
    ), report
    (course.root / "public/index.html").unlink()
    report = course.main("diff", "HEAD", *sites).out
    assert report.endswith("\nNot compared: there is no site in `public`.\n")
    result = course.main("diff", "HEAD", "--site", "preview")
    assert (result.status, "need each other" in result.err) == (2, True)


def test_a_base_that_cannot_be_had(course: Folder, tmp_path: Path) -> None:
    result = course.main("diff", "nowhere")
    message = "coursebuild: `nowhere` is neither a folder with a course nor a Git revision here\n"
    assert (result.status, result.out, result.err) == (2, "", message)
    first = git(course.root, "rev-parse", "HEAD")
    (course.root / "content/course.toml").rename(tmp_path / "map")
    commit(course.root)
    (tmp_path / "map").rename(course.root / "content/course.toml")
    result = course.main("diff", "main")
    assert (result.status, "the course map" in result.err) == (2, True)
    assert course.main("diff", first).status == 0


def test_a_partial_clone_lacks_the_base(course: Folder, tmp_path: Path) -> None:
    """Nothing is fetched, since the repository says from where and how."""
    git(course.root, "config", "uploadpack.allowFilter", "true")
    course.write("content/new.md", "text\n")
    commit(course.root)
    (course.root / "content/new.md").unlink()
    commit(course.root)
    for part in ("blob:none", "tree:0"):
        place = str(tmp_path / part.replace(":", "-"))
        git(tmp_path, "clone", "--quiet", f"--filter={part}", f"file://{course.root.parent}", place)
        result = course.main("-C", f"{place}/{course.root.name}", "diff", "HEAD^")
        assert (result.status, result.out) == (1, "")
        lack = "cannot be copied: this repository does not hold all of it\n  help: in a partial"
        assert lack in result.err, result.err
