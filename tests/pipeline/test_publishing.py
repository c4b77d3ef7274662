"""Nothing broken is published, and the old site stays."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from support.scratch_course import GOOD, Make, block, without_locks

pytestmark = pytest.mark.site


def test_drift_is_not_published_and_update_puts_it_back(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    good, site = folder.read(folder.lesson()), folder.tree("public")
    folder.replace(folder.lesson(), "hello 3.14159\n", "hello 3.14158\n")
    result = folder.main("build")
    assert result.status == 1
    line = folder.text(folder.lesson()).splitlines().index("hello 3.14158") + 1
    assert f"--> {folder.lesson()}:{line}:7\n" in result.out
    assert "nothing was published; public stays as it is\n" in result.out
    assert "run `coursebuild update 1.1`" in result.out
    assert folder.tree("public") == site
    assert folder.main("update", "1.1").status == 0
    assert folder.read(folder.lesson()) == good
    assert folder.main("build").status == 0
    assert folder.tree("public") == site


MISTAKES: dict[str, bytes] = {
    "link": b"[gone](lesson:7.7)\n",
    "math": b"$\\frac{1$\n",
    "script": block("fails.py", "1/0").encode(),
    "mjcf": b"```mjcf\n<mujoco><nosuch/></mujoco>\n```\n",
    "image": b"![a](gone.png)\n",
    "json": b'```quiz\n{"id": "q"}\n```\n',
    "binding": b"`3.15`{out}\n",
    "encoding": b"\xff\n",
}


def test_site_stays_as_it_was_whatever_the_mistake(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    site = folder.tree("public")
    for kind, mistake in MISTAKES.items():
        folder.write(folder.lesson(), GOOD.encode() + mistake)
        assert folder.main("build").status == 1, kind
        assert folder.tree("public") == site, kind


def test_nothing_is_published_before_there_is_a_site(make: Make) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")
    result = folder.main("build")
    assert result.status == 1
    assert "\nnothing was published\n" in result.out
    assert folder.entries() == [
        ".coursebuild",
        "content",
        "content/course.toml",
        "content/lessons",
        "content/lessons/1.1-one.md",
        "examples",
        "examples/.extracted.json",
        "examples/hello.py",
    ]


def test_files_of_somebody_else_are_never_removed(make: Make) -> None:
    folder = make(GOOD)
    folder.write("out/notes.txt", "mine")
    result = folder.main("build", "--out", "out")  # refused before any script runs
    assert (result.status, result.out) == (2, "")
    assert not (folder.root / "examples").exists()
    assert folder.read("out/notes.txt") == b"mine"


def test_caches_that_are_gone_or_damaged_are_made_again(make: Make, stores: Path) -> None:
    folder = make(GOOD + "Őrült żółw\n")  # for which fonts are cut
    assert folder.main("build").status == 0
    site, caches = folder.tree(), folder.root / ".coursebuild"
    (caches / "fonts").unlink()
    shutil.copytree(stores / "fonts", caches / "fonts")
    for font in (caches / "fonts").iterdir():
        font.write_bytes(b"")
    assert folder.main("build").status == 0
    assert folder.tree() == site
    shutil.rmtree(caches)
    caches.mkdir()
    (caches / "fonts").symlink_to(stores / "fonts")
    assert folder.main("build").status == 0
    assert folder.tree() == site


def test_builds_at_once_wait_for_each_other_without_locks(make: Make) -> None:
    """On a file system that has none, where two would fill the same folder."""
    folder = make(GOOD)
    code = without_locks() + "import sys\nfrom coursebuild.cli import main\nsys.exit(main())\n"
    assert folder.main("build").status == 0
    site = folder.tree("public")
    for number in range(3):
        course_map = folder.text("content/course.toml")
        folder.replace("content/course.toml", "[course]", f"[course]\nsummary = 'Of {number}'")
        shutil.rmtree(folder.root / "public")
        builds = [folder.start("build", code=code, stderr=subprocess.PIPE) for _ in range(3)]
        texts = [build.communicate()[1] for build in builds]
        assert [build.returncode for build in builds] == [0, 0, 0], texts
        assert f"Of {number}" in folder.text("public/index.html")
        folder.write("content/course.toml", course_map)
    assert folder.main("build").status == 0
    assert folder.tree("public") == site
    assert ".coursebuild-lock" not in folder.entries()
