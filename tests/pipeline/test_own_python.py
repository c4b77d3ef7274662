"""Scripts run by the interpreter of a course's own environment, and those of strangers."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy
import pytest

from coursebuild.core.run.script_environment import engine_version, python_version
from support.fixture_cases import fixture_text
from support.sandboxes import require_sandbox
from support.scratch_course import GOOD, Folder, Make, block

pytestmark = pytest.mark.site


PYTHON = ".venv/bin/python"
SCRIPT = fixture_text("scripts/own_python.txt")
OUTPUT = "/.venv Mars mjcourse.spatial\nNo module named 'msgspec'"


@pytest.fixture
def course(make: Make) -> Folder:
    return with_environment(make, SCRIPT, OUTPUT)


def with_environment(make: Make, script: str, printed: str) -> Folder:
    """A course with an environment that has MuJoCo, what that needs, and a package `planet`."""
    folder = make("## One\n\n" + block("a.py", script, printed))
    folder.replace("content/course.toml", "[course]\n", '[course]\nengine = "0.0.0"\n')
    folder.replace("content/course.toml", "0.0.0", engine_version())
    map = folder.text("content/course.toml")
    folder.write("content/course.toml", f'{map}\n[verify]\npython = "{PYTHON}"\n')
    environment(folder)
    return folder


def environment(folder: Folder) -> Path:
    """Make an environment; return the folder of its packages."""
    prefix = folder.root / ".venv"
    subprocess.run([sys.executable, "-m", "venv", "--clear", "--without-pip", prefix], check=True)
    (packages,) = prefix.glob("lib/python*/site-packages")
    for name in ("mujoco", "numpy", "typing_extensions"):
        for path in Path(numpy.__file__).parents[1].glob(f"{name}*"):
            (packages / path.name).symlink_to(path)
    install(packages, "1.0", "Mars")
    return packages


def install(packages: Path, version: str, name: str) -> None:
    for old in packages.glob("planet-*"):
        shutil.rmtree(old)
    info = packages / f"planet-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: planet\nVersion: {version}\n")
    (info / "top_level.txt").write_text("planet\n")
    (packages / "planet.py").write_text(f"NAME = {name!r}\n")


def test_scripts_find_what_is_installed_in_the_environment_of_the_course(course: Folder) -> None:
    """They run again when something is installed there, and find only `mjcourse` of ours."""
    (packages,) = (course.root / ".venv").glob("lib/python*/site-packages")
    result = course.run("check").require_success()
    assert "1 script" in result.out
    again = course.run("check")
    assert again.status == 0
    assert "nothing has changed since the last check" in again.out
    install(packages, "1.1", "Venus")
    drifted = course.run("check")
    assert drifted.status == 1
    assert "Venus" in drifted.out
    assert course.main("update").status == 0
    assert "/.venv Venus mjcourse.spatial" in course.text(course.lesson())
    explained = course.main("explain", "examples/a.py").out
    assert "planet 1.1" in explained
    assert "remembered" in explained
    assert course.main("build").status == 0
    page = course.text("public/lessons/1.1-one.html")
    assert f"MuJoCo {engine_version()}" in page and f"Python {python_version()}" in page


def test_runners_of_other_languages_may_lie_in_this_environment(make: Make) -> None:
    """Its programs go before those of PATH, as an activated environment has it."""
    folder = with_environment(make, "print(1)", "1")
    folder.write(".venv/bin/no-such-lisp", "#!/bin/sh\necho lisp\n")
    (folder.root / ".venv/bin/no-such-lisp").chmod(0o755)
    course_map = folder.text("content/course.toml")
    runner = '[runners]\nlisp = [["no-such-lisp", "{file}"]]\n'
    folder.write("content/course.toml", f"{course_map}\n{runner}")
    script = "```lisp file=examples/a.lisp\n(print 1)\n```\n\n```output\nlisp\n```\n"
    folder.write(folder.lesson(), folder.text(folder.lesson()) + f"\n{script}")
    folder.run("check", "--strict").require_success()
    (folder.root / ".venv/bin/no-such-lisp").unlink()
    assert "needs no-such-lisp" in folder.run("check").out


def replace_engine(info: Path, version: str) -> None:
    info.unlink()
    new = info.with_name(f"mujoco-{version}.dist-info")
    new.mkdir()
    (new / "METADATA").write_text(f"Metadata-Version: 2.1\nName: mujoco\nVersion: {version}\n")


BROKEN_ENVIRONMENTS: tuple[tuple[Callable[[Path], object], str], ...] = (
    (
        lambda prefix: (prefix / "bin/python").unlink(),
        "error[script-python]: there is no interpreter `.venv/bin/python`",
    ),
    (
        lambda prefix: (prefix / "pyvenv.cfg").unlink(),
        "error[script-python]: `.venv/bin/python` is not of a virtual environment",
    ),
    (
        lambda prefix: (prefix / "pyvenv.cfg").write_text("version_info = 3.9.1.final.0\n"),
        "error[script-python]: `.venv/bin/python` is of Python 3.9.1.final.0",
    ),
    (
        lambda prefix: next(prefix.glob("lib/*/*/mujoco-*")).unlink(),
        "error[script-python]: MuJoCo is not installed for `.venv/bin/python`",
    ),
    (
        lambda prefix: replace_engine(next(prefix.glob("lib/*/*/mujoco-*")), "3.1.0"),
        f"error[engine-version]: the course is written for MuJoCo {engine_version()}, and 3.1.0 "
        "is installed for `.venv/bin/python`",
    ),
)


def test_an_environment_in_which_scripts_cannot_run_is_told(course: Folder) -> None:
    result = course.main("check", "--against", "3.1.0")
    assert result.status == 2
    assert "scripts of this course run with .venv/bin/python" in result.err
    for spoil, message in BROKEN_ENVIRONMENTS:
        spoil(course.root / ".venv")
        result = course.main("check")
        assert result.status == 1
        assert result.out.startswith(message), result.out
        assert "--> content/course.toml:" in result.out
        assert result.out.count("error[") == 1
        environment(course)
    python = course.root / PYTHON
    python.unlink()
    python.write_text("#!/bin/sh\nexit 3\n")
    python.chmod(0o755)
    result = course.main("check", "--no-cache")
    assert result.status == 1
    assert f"{python} cannot run scripts" in result.err


def test_the_sandbox_has_this_environment_and_no_other_folder_it_names(make: Make) -> None:
    """A file of the course names the folder of its Python, and may name any folder."""
    script = "import os, sys, planet\nprint(planet.NAME, os.path.exists(sys.argv[1]))"
    folder = with_environment(make, script, "Mars False")
    require_sandbox(folder.root)
    home = folder.root.parent / "home"
    (home / "lib").mkdir(parents=True)
    folder.replace(folder.lesson(), "file=examples/a.py", f'file=examples/a.py args="{home}"')
    folder.main("check", "--sandbox").require_success()
    settings = folder.root / ".venv/pyvenv.cfg"
    home_line = f"home = {home}/bin\n"
    lines = settings.read_text().splitlines(keepends=True)
    settings.write_text("".join(home_line if line.startswith("home") else line for line in lines))
    result = folder.main("check", "--sandbox", "--no-cache")
    assert result.status == 1 and "cannot run scripts" in result.err


@pytest.mark.parametrize("words", [("check",), ("build",), ("export", "epub")])
def test_environment_of_the_course_runs_in_the_sandbox_alone(
    make: Make, words: tuple[str, ...], tmp_path: Path
) -> None:
    folder = with_environment(make, "print(1)", "1")
    require_sandbox(folder.root)
    folder.replace(folder.lesson(), "## ", "It calls `mj_step` and `planet.NAME`.\n\n## ")
    marks = [folder.root / "ran", tmp_path / "ran"]
    python = folder.root / PYTHON
    python.unlink()
    python.write_text(f"#!/bin/sh\ntouch {' '.join(map(shlex.quote, map(str, marks)))}\nexit 3\n")
    python.chmod(0o755)
    result = folder.main(*words, "--sandbox")
    assert result.status == 1 and f"{python} cannot run scripts" in result.err
    assert not any(mark.exists() for mark in marks)
    folder.main(*words)
    assert all(mark.exists() for mark in marks), "without it, scripts have all rights"


WRITES = "from pathlib import Path\nPath('new').write_text('x')\nprint(1)"


def test_results_count_in_the_sandbox_and_outside(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", "print(1)", "1"))
    require_sandbox(folder.root)
    first = folder.main("check", "--sandbox", "-v")
    assert first.status == 0 and "running scripts (1)" in first.err, first
    assert "running scripts" not in folder.main("build").err
    folder.replace(folder.lesson(), "print(1)", "print( 1)")
    assert "running scripts (1)" in folder.main("check").err
    assert "running scripts" not in folder.main("build", "--sandbox").err


def test_what_a_script_changes_is_told_and_in_the_sandbox_does_not_happen(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", WRITES, "1"))
    require_sandbox(folder.root)
    inside = folder.main("check", "--sandbox")
    assert inside.status == 1 and "Read-only file system" in inside.out
    assert not (folder.root / "new").exists()
    outside = folder.main("check")
    assert outside.status == 0 and (folder.root / "new").exists()
    for result in (inside, outside):
        assert "warning[script-writes]: `examples/a.py` writes outside its" in result.out
        assert f"--> {folder.lesson()}:5:1" in result.out


def test_code_that_the_tool_would_run_is_refused(make: Make) -> None:
    folder = make(GOOD)
    require_sandbox(folder.root)
    map = folder.text("content/course.toml")
    folder.write("features/evil.py", "open('evil', 'w')\n")
    with_feature = map.replace("[course]\n", '[course]\nfeatures = ["features/evil.py"]\n')
    folder.write("content/course.toml", with_feature)
    for words in (("check",), ("build",), ("export", "epub")):
        result = folder.main(*words, "--sandbox")
        assert (result.status, result.out) == (1, "")
        assert "`features/evil.py` is code that the tool would run" in result.err
    assert "there is no export `evil`" in folder.main("export", "evil", "--sandbox").err
    assert not (folder.root / "evil").exists()
    folder.write("content/course.toml", map)
    folder.write("theme/templates/page.html", "{{ 1 }}")
    result = folder.main("build", "--sandbox")
    assert result.status == 1 and "`theme/templates/` is code" in result.err


def test_nothing_runs_without_a_sandbox(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make(GOOD)
    monkeypatch.setenv("PATH", str(tmp_path))
    result = folder.main("check", "--sandbox")
    assert (result.status, result.out) == (1, "")
    assert result.err == (
        "coursebuild: `--sandbox` needs Bubblewrap, but there is no program `bwrap`\n"
        "  help: install it, for example with `apt-get install bubblewrap`\n"
    )
    assert not (folder.root / "examples").exists()
