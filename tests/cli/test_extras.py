"""What an installation without extras lacks is said by the command that needs it."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path

import pytest

from support.fixture_cases import fixture_tables, fixture_text
from support.preview_process import serve_preview
from support.scratch_course import GOOD, Folder

LESSONS = tomllib.loads(fixture_text("documents/extras.toml"))


@pytest.mark.engine
@pytest.mark.parametrize(
    ("package", "lesson", "command", "message"), fixture_tables("extras")["commands"]
)
def test_command_names_the_extra_that_it_needs(
    package: str,
    lesson: str,
    command: str,
    message: str,
    tmp_path: Path,
    stores: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSONS[lesson]], stores)
    monkeypatch.setitem(sys.modules, package, None)
    result = folder.main(command, "--quiet")
    advice = "\n  help: run `pip install 'coursebuild[measure]'`\n"
    if package == "PIL":
        advice = ": run `pip install 'coursebuild[figures]'`\n"
    assert message + advice in result.out + result.err
    assert result.status == 1


@pytest.mark.engine
def test_lab_of_formulas_and_build_need_no_extra(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSONS["formula"]], stores)
    for package in ("mjbench", "scipy", "matplotlib", "PIL", "pygls", "fsspec"):
        monkeypatch.setitem(sys.modules, package, None)
    folder.main("build").require_success()
    assert (folder.root / "public/index.html").is_file()


@pytest.mark.site
def test_a_course_without_models_needs_neither_mujoco_nor_numpy(
    tmp_path: Path, stores: Path
) -> None:
    """In an environment with all packages of this one but these."""
    venv.create(tmp_path / "environment", symlinks=True)
    (packages,) = (tmp_path / "environment/lib").glob("python*/site-packages")
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if not path.name.startswith(("mujoco", "numpy")):
            (packages / path.name).symlink_to(path)
    python = tmp_path / "environment/bin/python"
    attempt = "import importlib.util as u; print(u.find_spec('mujoco'), u.find_spec('numpy'))"
    assert subprocess.check_output([python, "-c", attempt]) == b"None None\n"
    words = [str(python), "-m", "coursebuild"]
    start = f"import os, sys; os.execv({words[0]!r}, [*{words}, *sys.argv[1:]])"
    folder = Folder(tmp_path / "course")
    folder.fill([GOOD + "\nIn one step $1.5^2 = 2.25$.\n"], stores)
    for command in ("check", "build"):
        with folder.start(command, code=start, stdout=subprocess.PIPE) as process:
            assert b"everything holds" in process.communicate()[0]
            assert process.returncode == 0
    assert b"<math" in (folder.root / "public/lessons/1.1-one.html").read_bytes()
    with serve_preview(folder, code=start) as preview:
        preview.wait_for_line("checked: ")
        assert b"<math" in preview.get("/lessons/1.1-one.html")[2]


@pytest.mark.site
def test_without_pygls_the_command_says_what_to_install(tmp_path: Path, stores: Path) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill(["## One\n"], stores)
    code = (
        "import sys; sys.modules['pygls'] = None\n"
        "from coursebuild.cli import main; sys.exit(main())"
    )
    process = folder.start("lsp", code=code, stderr=subprocess.PIPE)
    message = b"coursebuild: the language server needs the package pygls\n"
    message += b"  help: run `pip install 'coursebuild[lsp]'`\n"
    assert (process.communicate()[1], process.returncode) == (message, 1)
