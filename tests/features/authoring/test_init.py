"""Commands with which one begins: `init` and `doctor`."""

from __future__ import annotations

import json
import os
import re
import subprocess
import tomllib
import venv
from importlib.metadata import version
from pathlib import Path

import pytest

from coursebuild import __version__
from coursebuild.core.run.script_environment import site_folders
from support.fixture_cases import fixture_text
from support.sandboxes import require_sandbox
from support.scratch_course import ROOT, Folder, command

REPORT = fixture_text("documents/init_report.txt")


@pytest.fixture(scope="module")
def new_course(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """A course as `init` writes it, which nobody changes."""
    folder = Folder(tmp_path_factory.mktemp("new"))
    result = folder.main("init")
    assert (result.status, "coursebuild serve " in result.out) == (0, True)
    return folder


@pytest.mark.site
@pytest.mark.engine
def test_new_course_passes_check_and_build_as_it_is(tmp_path: Path, stores: Path) -> None:
    outside = Folder(tmp_path)
    name = "a cöurse's"
    result = outside.main("init", name)
    assert (result.status, result.err) == (0, "")
    assert result.out == REPORT.format(name, """'a cöurse'"'"'s'""")
    folder = Folder(tmp_path / name)
    files = folder.tree()
    for store in stores.iterdir():
        (folder.root / ".coursebuild" / store.name).symlink_to(store)
    result = folder.main("check", "--no-cache")
    assert (result.status, result.out.splitlines()[-1]) == (
        0,
        "1 lesson, 1 script run, 1 lab tried: everything holds",
    )
    assert result.out.startswith("ok "), "not even a warning"
    assert folder.main("build").status == 0
    assert {path: data for path, data in folder.tree().items() if path in files} == files
    page = folder.text("public/lessons/1.1-pendulum.html")
    for part in ("data-lab", "data-quiz", "swing", "2.0125 s"):
        assert part in page, part


@pytest.mark.site
def test_new_course_has_what_git_and_an_editor_need(new_course: Folder) -> None:
    files = new_course.tree()
    assert {"public/", "examples/", ".coursebuild/"} <= {*new_course.text(".gitignore").split()}
    for path, data in files.items():
        if path.endswith(".json"):
            assert json.loads(data), path
        if path.endswith(".toml"):
            schema = data.decode().splitlines()[0].removeprefix("#:schema ")
            assert (new_course.root / "content" / schema).is_file()
            assert tomllib.loads(data.decode())["verify"] == {"compare": "digits"}


@pytest.mark.site
def test_new_course_names_its_packages_with_hashes(new_course: Folder) -> None:
    text = new_course.text("requirements.lock")
    requirements = re.split(r"(?m)^(?=[\w.-]+==)", text)[1:]
    assert len(requirements) > 30
    assert [r for r in requirements if not re.search(r"--hash=sha256:[0-9a-f]{64}\b", r)] == []
    assert f"\ncoursebuild=={__version__}\n" in new_course.text(".github/coursebuild.txt")
    drawing = {f"{name}=={version(name)}" for name in ("matplotlib", "pillow")}
    assert {*new_course.text("requirements.txt").splitlines()[3:]} == drawing


@pytest.mark.site
def test_new_course_has_one_engine_and_one_lock_at_home_and_for_jobs(new_course: Folder) -> None:
    (engine,) = re.findall(r"(?m)^mujoco==(\S+)", new_course.text("requirements.lock"))
    assert tomllib.loads(new_course.text("content/course.toml"))["course"]["engine"] == engine
    installation = "pip install --require-hashes -r requirements.lock\n"
    texts = ["README.md", ".github/workflows/course.yml", ".github/workflows/weekly.yml"]
    assert [path for path in texts if installation not in new_course.text(path)] == []


@pytest.mark.site
def test_nothing_is_overwritten(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.write("own/.gitignore", "*.log\n")
    folder.write("own/models/pendulum.xml", "<mujoco/>")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked/.gitignore").symlink_to("nowhere")
    before = folder.tree()
    result = folder.main("init", "own")
    assert (result.status, result.out, result.err) == (
        2,
        "",
        "coursebuild: own has .gitignore, models/pendulum.xml already, so nothing was written\n"
        "  help: name another folder, as in `coursebuild init my-course`\n",
    )
    assert folder.main("init", "linked").status == 2
    assert folder.tree() == before
    folder.write("file", "text")
    result = folder.main("init", "file")
    assert (result.status, result.err) == (1, "coursebuild: file cannot be created: file exists\n")
    folder.write("half/models", "a file")
    result = folder.main("init", "half")
    assert (result.status, "models/pendulum.xml cannot be written: " in result.err) == (1, True)
    assert folder.tree("half") == {"models": b"a file"}
    result = folder.main("init", os.fsdecode(b"caf\xe9"))
    assert (result.status, "the path of the course is not UTF-8: " in result.err) == (2, True)
    (tmp_path / "kept").mkdir()
    folder.write("kept/README.md", "# Mine\n")
    assert folder.main("-C", "kept", "init").status == 0
    assert folder.text("kept/README.md") == "# Mine\n"
    folder.write("listed/requirements.txt", "pandas\n")
    assert folder.main("init", "listed").status == 0
    assert folder.text("listed/requirements.txt") == "pandas\n"
    assert folder.main("init", "kept").status == 2


@pytest.mark.site
def test_new_course_is_a_repository_unless_it_lies_in_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path)
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "elsewhere"))
    assert "in a new Git repository\n" in folder.main("init", "course").out
    assert folder.text("course/.git/HEAD") == "ref: refs/heads/main\n"
    assert not (tmp_path / "elsewhere").exists()
    assert "Git" not in folder.main("init", "course/part").out
    assert not (tmp_path / "course/part/.git").exists()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert folder.main("init", "without").out.startswith("wrote 17 files to without\n")
    assert not (tmp_path / "without/.git").exists()


@pytest.mark.site
def test_of_a_repository_that_git_cannot_make_nothing_is_left(tmp_path: Path) -> None:
    """Git copies the user's template first, and then finds that its own folders have no place."""
    folder = Folder(tmp_path)
    folder.write("template/refs", "a file")
    folder.write("template/description", "text")
    folder.write("home/.gitconfig", f"[init]\ntemplateDir = {tmp_path}/template\n")
    result = folder.run("init", "course", env={"HOME": str(tmp_path / "home")})
    assert (result.status, result.out.splitlines()[0]) == (0, "wrote 17 files to course")
    (line,) = result.err.splitlines()
    assert line.startswith("no Git repository was made: ")
    assert "refs" in line
    assert [*tmp_path.rglob(".git"), *tmp_path.rglob("description")] == [
        tmp_path / "template/description"
    ]
    result = folder.run("init", "other", env={"XDG_STATE_HOME": "/dev/null"})
    assert result.out.startswith("wrote 17 files to other\n")
    assert "was made: .coursebuild needs a key of its user's own, and there is now" in result.err


@pytest.mark.site
def test_a_repository_goes_again_where_the_course_cannot_be_written(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.write("course/models", "a file")
    before = folder.tree()
    result = folder.main("init", "course")
    assert (result.status, "models/pendulum.xml cannot be written: " in result.err) == (1, True)
    assert (folder.tree(), [*tmp_path.rglob(".git")]) == (before, [])
    (tmp_path / "course/models").unlink()
    assert "in a new Git repository\n" in folder.main("init", "course").out


@pytest.mark.site
@pytest.mark.engine
def test_doctor_reports_what_works_and_a_cure_for_the_rest(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.tmp.mkdir()
    result = folder.run("doctor", env={"MUJOCO_GL": "disabled"})
    assert (result.status, result.err) == (0, "")
    report = re.sub(r"\d+(\.\d+)*", "#", result.out)
    for line in (
        "ok       Python # at ",
        "ok       MuJoCo #\n",
        "ok       MuJoCo # of the browser, in V#, for labs\n",
        "-        no offscreen rendering: ",
        "--sandbox`",
    ):
        assert line in report, line
    sandbox = [line for line in result.out.splitlines() if "--sandbox`" in line]
    assert all(line.startswith("ok ") for line in sandbox[:-1])
    assert sandbox[-1].startswith(("ok       limits of memory", "-        `--sandbox` "))
    cure = r"\n         help: (set the environment variable MUJOCO_GL=|install a driver)"
    assert re.search(cure, result.out)
    assert f"ok       {folder.root} can be written\n" in result.out
    assert not [path for path in folder.root.iterdir() if path != folder.tmp]


@pytest.mark.site
@pytest.mark.engine
def test_doctor_says_that_a_folder_is_read_only(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    (tmp_path / "course").mkdir()
    root = str(tmp_path / "course")
    program = require_sandbox(tmp_path).program
    result = subprocess.run(
        [program, "--dev-bind", "/", "/", "--ro-bind", root, root, *command("-C", root, "doctor")],
        env=folder.environment(),
        capture_output=True,
        text=True,
    )
    help = "         help: get permission to write there, or use another folder\n"
    assert f"\nbroken   {root} cannot be written\n{help}" in result.stdout
    assert f"\n-        results cannot be kept in {root}/.coursebuild\n{help}" in result.stdout
    assert result.returncode == 1


@pytest.mark.site
@pytest.mark.engine
def test_doctor_says_what_a_sandbox_lacks(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.tmp.mkdir()
    folder.write("programs/bwrap", "#!/bin/sh\necho 'bwrap: no namespaces' >&2\nexit 1\n")
    (folder.root / "programs/bwrap").chmod(0o755)
    result = folder.run("doctor", env={"PATH": f"{folder.root}/programs", "MUJOCO_GL": "disabled"})
    assert result.out.endswith(
        "ok       Bubblewrap, for `--sandbox`\n"
        "ok       a filter of system calls, for `--sandbox`\n"
        "-        `--sandbox` does not work here, Bubblewrap says: no namespaces\n"
        "         help: it needs Bubblewrap 0.8 or newer, and user namespaces: on Ubuntu, "
        "`sudo sysctl kernel.apparmor_restrict_unprivileged_userns=0` allows them; containers "
        "often forbid them\n"
        "\nall that every course needs works\n"
    )
    assert result.status == 0


@pytest.mark.site
@pytest.mark.engine
def test_doctor_fails_where_a_course_cannot_be_built(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.tmp.mkdir()
    # An environment with the packages of this one, in which MuJoCo is broken
    venv.create(folder.root / "broken", symlinks=True)
    (packages,) = (folder.root / "broken/lib").glob("python3.*/site-packages")
    (packages / "mujoco").mkdir()
    (packages / "mujoco/__init__.py").write_text("raise ImportError('no library')\n")
    (packages / "others.pth").write_text("\n".join(map(str, [*site_folders(), ROOT])))
    result = subprocess.run(
        [folder.root / "broken/bin/python", "-m", "coursebuild", "doctor"],
        cwd=folder.root,
        env=folder.environment(),
        capture_output=True,
        text=True,
    )
    assert (result.returncode, result.stderr) == (1, "")
    probe = r"^broken   MuJoCo [\d.]+: ImportError: no library$"
    assert re.search(probe, result.stdout, re.MULTILINE)
    help = "\n         help: install coursebuild again, into an environment of its own\n"
    assert help in result.stdout
    assert result.stdout.endswith("\nbroken: 1 thing that every course needs\n")
    result = folder.main("doctor", "-C", "no/such")
    assert (result.status, result.err) == (2, "coursebuild: there is no folder no/such\n")
