"""`coursebuild check --against`, with packages from a folder in the place of an index."""

from __future__ import annotations

import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from coursebuild.core.files.trust import store_key
from coursebuild.core.run.environments import latest_version
from coursebuild.core.run.script_environment import engine_version
from support.fixture_cases import fixture_text
from support.scratch_course import CommandResult, Folder, Make, block, kill_at_end, wait_until_alone
from support.waiting import wait_for_file

pytestmark = pytest.mark.long

VERSION = engine_version()
NEW_VERSION = "9.1.0"
REAL_NUMBER = int("{:d}{:03d}{:03d}".format(*map(int, VERSION.split("."))))
ENGINE = fixture_text("scripts/small_mujoco.txt")


@pytest.fixture
def wheels(installed: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with wheels of small packages, the only place where pip looks."""
    folder = installed.with_name("wheels")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for version, number in ((VERSION, REAL_NUMBER), (NEW_VERSION, 9_001_000)):
        code = ENGINE.format(version=version, number=number)
        code += (
            "def mju_isBad(x):\n    return 1\n" if version == VERSION else "import mujoco_core\n"
        )
        wheel(folder, version, code, part="" if version == VERSION else f"mujoco-core=={version}")
    wheel(folder, NEW_VERSION, "", name="mujoco_core")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    return folder


def wheel(folder: Path, version: str, code: str, name: str = "mujoco", part: str = "") -> None:
    """Write a wheel of a small MuJoCo, or of a package that it needs."""
    info = f"{name}-{version}.dist-info"
    needs = "Requires-Dist: nowhere-to-be-found\n"  # it needs what is installed here
    needs += f"Requires-Dist: {part}\nRequires-Dist: mujoco-usd; extra == 'usd'\n" if part else ""
    files = {
        f"{name}/__init__.py": code,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needs}",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    files[f"{info}/RECORD"] = "".join(f"{file},,\n" for file in [*files, f"{info}/RECORD"])
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as archive:
        for file, text in files.items():
            archive.writestr(file, text)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Environments that were made for another course."""
    return tmp_path_factory.mktemp("environments")


@pytest.fixture(autouse=True)
def state(tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A state folder for each test, with the key by which what is shared was sealed."""
    place = tmp_path / "state/coursebuild"
    place.mkdir(parents=True)
    (place / "key").write_bytes(store_key(str(tmp_path)))
    monkeypatch.setenv("XDG_STATE_HOME", str(place.parent))


def environments_folder() -> Path:
    return Path(os.environ["XDG_STATE_HOME"], "coursebuild/environments")


def borrow(course: Folder, environments: Path, version: str = "") -> Folder:
    """Take environments that were made before: all, or those of a version."""
    place = environments_folder()
    if place.is_symlink():
        place.unlink()
    shutil.rmtree(place, ignore_errors=True)
    if not version:
        place.symlink_to(environments)
        return course
    place.mkdir()
    for path in environments.glob(f"mujoco-{version}-*"):
        (place / path.name).symlink_to(path)
    return course


def environments(course: Folder) -> list[str]:
    """The MuJoCo versions of the user's environments, and other files beside these."""
    names = (path.name for path in environments_folder().glob("*"))
    return sorted(name.removeprefix("mujoco-").rpartition("-")[0] for name in names)


def check_against(course: Folder, *arguments: str, version: str = NEW_VERSION) -> CommandResult:
    return course.main("check", "--against", version, *arguments)


PLAIN = block("plain.py", 'print("no engine", 2.5)', "no engine 2.5")
NUMBER = block(
    "number.py",
    'import mujoco\nprint("header", mujoco.mjVERSION_HEADER)\nprint("and 1")',
    f"header {REAL_NUMBER}\nand 1",
)
FAILING_SCRIPT = block("failing.py", "import mujoco\nmujoco.mju_isBad(1.0)\nprint(1)", "1")


SUM = f"MuJoCo {NEW_VERSION} against {VERSION}, Python {platform.python_version()}:"


def test_changed_outputs_are_told_number_by_number(
    make: Make, wheels: Path, installed: Path
) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}{FAILING_SCRIPT}", f"## B\n\n{PLAIN}"), installed)
    assert course.main("check", "-q").out == ""
    report = json.loads(check_against(course, "1.2", "--format", "json", "-q").out)
    assert [(s["path"], s["status"]) for s in report["scripts"]] == [("examples/plain.py", "same")]
    assert (report["engine"], report["against"], report["models"]) == (VERSION, NEW_VERSION, [])
    assert environments(course) == [NEW_VERSION], "no control was needed"
    quiet, result = check_against(course, "-q"), check_against(course)
    error = abs(9_001_000 - REAL_NUMBER) / REAL_NUMBER
    assert (quiet.status, quiet.err, result.status) == (0, "", 0)
    assert quiet.out == result.out.replace("same       examples/plain.py\n\n", "")
    assert (
        result.out
        == f"""\
changed    examples/number.py  by MuJoCo {NEW_VERSION}
  content/lessons/1.1-one.md:12:8: recorded {REAL_NUMBER}; MuJoCo {NEW_VERSION} printed 9001000 \
(relative error {error:.1e}, no digit agrees)

fails      examples/failing.py  by MuJoCo {NEW_VERSION}
  content/lessons/1.1-one.md:18: `examples/failing.py` exited with status 1: AttributeError: \
module 'mujoco' has no attribute 'mju_isBad'

same       examples/plain.py

{SUM} 3 scripts: 1 the same, 1 changed by MuJoCo {NEW_VERSION}, 1 failing with MuJoCo {NEW_VERSION}
"""
    )
    assert environments(course) == sorted((VERSION, NEW_VERSION))
    report = json.loads(check_against(course, "--format", "json", "-q").out)
    first = report["scripts"][0]
    assert (first["status"], first["by_mujoco"], first["failure"]) == ("changed", True, None)
    (change,) = first["changes"]
    assert (change["recorded"], change["printed"]) == (str(REAL_NUMBER), "9001000")
    assert (change["path"], change["line"], change["column"]) == (course.lesson(), 12, 8)
    assert report["summary"]["changed"] == report["summary"]["same"] == 1
    # A further run installs nothing, and runs only what must run twice.
    again = check_against(course)
    assert again.out == result.out
    assert "installing" not in again.err
    assert again.err.count(": ok after") == 1
    # Its results do not count as those of the environment here.
    assert course.main("check").out.count("cached") == 4


def test_names_that_the_other_version_lacks_are_listed(
    make: Make, wheels: Path, installed: Path
) -> None:
    text = "## A\n\nIt calls `mj_forward(model, data)`, and `mj_step`; `data.qpos` is `<geom>`.\n"
    course = borrow(make(text, "## B\n"), installed)
    result = check_against(course)
    assert (
        result.out
        == f"""\
lost       content/lessons/1.1-one.md:3:11  MuJoCo {NEW_VERSION} discourages `mj_forward`: \
This is deprecated, take another.
lost       content/lessons/1.1-one.md:3:42  MuJoCo {NEW_VERSION} has no `mj_step`
lost       content/lessons/1.1-one.md:3:53  MuJoCo {NEW_VERSION} has no `data.qpos`
lost       content/lessons/1.1-one.md:3:69  MuJoCo {NEW_VERSION} has no `geom`

{SUM} 0 scripts: nothing to compare
"""
    )
    report = json.loads(check_against(course, "--format", "json", "-q").out)
    assert [(name["line"], name["column"]) for name in report["names"]][:2] == [(3, 11), (3, 42)]


def test_another_cause_than_mujoco_is_not_blamed_on_it(
    make: Make, wheels: Path, installed: Path
) -> None:
    """A script that depends on where MuJoCo is installed."""
    code = 'import mujoco\nprint(3.1416 - ("environments" in mujoco.__file__))'
    lesson = "## A\n\n" + block("pi.py", code, "3.1416")
    course = borrow(make(lesson), installed)
    assert check_against(course, "-q").out.startswith(
        f"unclear    examples/pi.py  (it does not do in a fresh environment with MuJoCo {VERSION} "
        "what it does here either)\n"
        "  content/lessons/1.1-one.md:11:1: recorded 3.1416; "
    )
    (wheels / f"mujoco-{VERSION}-py3-none-any.whl").unlink()
    assert check_against(
        borrow(make(lesson, name="alone"), installed, NEW_VERSION), "-q"
    ).out.startswith(
        f"unclear    examples/pi.py  (no fresh environment with MuJoCo {VERSION} could be made: "
        f"pip finds no MuJoCo {VERSION} for Python "
    )


def test_scripts_that_cannot_be_compared_say_why(make: Make, wheels: Path, installed: Path) -> None:
    random = "import mujoco, os\nprint(mujoco.__version__, os.urandom(8).hex())"
    fixed = (
        "import mujoco, os\n"
        f"print('{VERSION}' if mujoco.__version__ == '{VERSION}' else os.urandom(8))"
    )
    course = make(
        "## A\n\n"
        + block("drifted.py", "print(1)", "2")
        + block("volatile.py", random, "x", comparison="volatile")
        + block("broken.py", "raise SystemExit(3)", "x")
        + block("never.py", "print(1)", "1", info="norun")
        + block("needs.py", "print(1)", "1", info="requires=nowhere")
        + block("lottery.py", fixed, VERSION)
        + block("printed.py", "import mujoco\nprint(mujoco.__version__)")
    )
    course.write("models/ball.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    course.write("models/broken.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>")
    result = check_against(borrow(course, installed), "-q")
    assert "fails      models/ball.xml:1  no longer compiles: no such element" in result.out
    assert "models/broken" not in result.out
    assert result.out.endswith("; 0 of 1 MJCF text compiles there\n")
    lines = [line for line in result.out.splitlines() if "  (" in line or "  by" in line]
    assert sorted(lines) == [
        f"changed    examples/printed.py  by MuJoCo {NEW_VERSION}",
        "drifted    examples/drifted.py  (what is recorded is not what it prints here)",
        "unclear    examples/lottery.py  (two runs of it there differed)",
        "uncompared examples/broken.py  (it does not run to its end here)",
        "uncompared examples/needs.py  (it needs nowhere)",
        "uncompared examples/never.py  (its lesson says `norun`)",
        "uncompared examples/volatile.py  (its output is volatile)",
    ]


def test_wrong_combinations_of_arguments_give_2(make: Make) -> None:
    course = make(f"## A\n\n{PLAIN}")
    for arguments, message in (
        (("--format", "sarif"), "--against cannot be combined with --format sarif"),
        (("--shard", "1/2"), "--against cannot be combined with --shard"),
        (("--write-timings", "x"), "--against cannot be combined with --write-timings"),
        (("--against", "three"), "--against: 'three' is not a version of MuJoCo, such as 3.13.0"),
        (("9.9",), "no lesson or page is called `9.9`; known: `1.1`"),
    ):
        result = check_against(course, *arguments)
        assert (result.status, result.out, result.err) == (2, "", f"coursebuild: {message}\n")
    assert environments(course) == []
    course.write("content/course.toml", "[[")
    result = check_against(course)
    assert result.status == 1
    assert result.err.startswith("coursebuild: the course cannot be read: content/course.toml:1: ")


def test_latest_is_the_newest_that_pip_finds(make: Make, wheels: Path, installed: Path) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}"), installed)
    assert f"changed by MuJoCo {NEW_VERSION}" in check_against(course, "-q", version="latest").out
    (wheels / f"mujoco-{NEW_VERSION}-py3-none-any.whl").unlink()
    result = check_against(course, "-q", version="latest")
    output = SUM.replace(NEW_VERSION, VERSION) + " 0 scripts: nothing to compare\n"
    assert (result.status, result.out) == (0, output)
    (wheels / f"mujoco-{VERSION}-py3-none-any.whl").unlink()
    result = check_against(course, "-q", version="latest")
    assert result.status == 1
    assert result.err.startswith("coursebuild: pip finds no MuJoCo at all for Python ")


def test_version_that_cannot_be_installed_leaves_nothing(make: Make, wheels: Path) -> None:
    course = make(f"## A\n\n{PLAIN}")
    result = check_against(course, "-q", version="9.0.9")
    assert result.status == 1
    assert result.err.startswith("coursebuild: pip finds no MuJoCo 9.0.9 for Python ")
    assert "\n  help: without a network, point pip to a folder of wheels" in result.err
    wheel(wheels, "9.2.0", "raise ImportError('built for another numpy')")
    result = check_against(course, "-q", version="9.2.0")
    assert result.err == (
        "coursebuild: MuJoCo 9.2.0 cannot be imported together with the other installed packages: "
        "ImportError: built for another numpy\n"
    )
    assert environments(course) == []


UV = fixture_text("scripts/uv.txt")
"""A stand-in that installs as uv would."""


def test_uv_installs_where_there_is_no_pip(
    make: Make, wheels: Path, installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}"), installed, VERSION)
    monkeypatch.setitem(sys.modules, "pip", None)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    result = check_against(course, "-q")
    assert result.err == (
        "coursebuild: this Python has no pip, and there is no uv, so nothing can be installed\n"
        "  help: run `python -m ensurepip`\n"
    )
    (tmp_path / "bin").mkdir()
    uv = tmp_path / "bin/uv"
    uv.write_text(UV.format(python=sys.executable))
    uv.chmod(0o755)
    assert f"changed by MuJoCo {NEW_VERSION}" in check_against(course, "-q").out
    result = check_against(course, "-q", version="9.0.9")
    assert result.err.startswith("coursebuild: uv finds no MuJoCo 9.0.9 for Python ")
    assert result.err.endswith("the environment variables UV_FIND_LINKS and UV_OFFLINE\n")


def test_environment_that_is_not_what_was_installed_is_made_anew(
    make: Make, wheels: Path, installed: Path
) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}"), installed, VERSION)
    first = check_against(course, "-q")
    assert f"changed by MuJoCo {NEW_VERSION}" in first.out
    (environment,) = environments_folder().glob(f"mujoco-{NEW_VERSION}-*")
    record = json.loads((environment / "record.json").read_text())
    assert record["requirements"] == [f"mujoco-core=={NEW_VERSION}", f"mujoco=={NEW_VERSION}"]
    assert [source.split()[0] for source in record["sources"]] == [
        (wheels / f"{name}-{NEW_VERSION}-py3-none-any.whl").as_uri()
        for name in ("mujoco", "mujoco_core")
    ]
    packages = next(environment.glob("lib/*/site-packages"))
    code = next(packages.glob("mujoco/__pycache__/*.pyc"))
    another = "has another `{}` than was installed"
    faults = dict.fromkeys((packages / "x.pth", code), another)
    faults[environment / "record.json"] = "has no record of what was installed"
    faults[packages / "numpy"] = another
    for path, fault in faults.items():
        if path.name == "numpy":
            path.symlink_to(wheels)
        else:
            path.write_text("raise SystemExit(3)")
        result = check_against(course)
        word = fault.format(path.relative_to(environment))
        assert f"{environment} {word}, and is made anew\n" in result.err
        assert f"changed by MuJoCo {NEW_VERSION}" in result.out
    assert "made anew" not in check_against(course).err


def test_environments_are_kept_apart_by_where_the_installer_looks(
    make: Make, wheels: Path, installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}"), installed, VERSION)
    check_against(course, "-q")
    mirror = tmp_path / "mirror"
    shutil.copytree(wheels, mirror)
    code = ENGINE.format(version=NEW_VERSION, number=9_002_000) + "import mujoco_core\n"
    wheel(mirror, NEW_VERSION, code, part=f"mujoco-core=={NEW_VERSION}")
    settings = tmp_path / "pip.conf"
    settings.write_text(f"[global]\nfind-links = {mirror}\nno-index = true\n")
    with monkeypatch.context() as patch:
        patch.delenv("PIP_FIND_LINKS")
        patch.delenv("PIP_NO_INDEX")
        patch.setenv("PIP_CONFIG_FILE", str(settings))
        assert "printed 9002000" in check_against(course, "-q").out
    assert "printed 9001000" in check_against(course, "-q").out


def test_settings_of_installers_in_a_course_are_not_obeyed(
    make: Make, wheels: Path, installed: Path
) -> None:
    course = borrow(make(f"## A\n\n{NUMBER}"), installed, VERSION)
    for name in ("pip.conf", "uv.toml", "pyproject.toml", "pip/__main__.py", "pip/__init__.py"):
        course.write(name, "raise SystemExit(3)")
    result = course.run("check", "--against", NEW_VERSION, "-q")
    assert f"changed by MuJoCo {NEW_VERSION}" in result.out, result.err


SLOW = """\
import pathlib, time
pathlib.Path({mark!r}).touch()
time.sleep(60)
"""


def test_interrupted_installations_leave_nothing_and_two_commands_at_once_install_once(
    make: Make, wheels: Path, tmp_path: Path
) -> None:
    mark = tmp_path / "importing"
    wheel(wheels, "9.4.0", SLOW.format(mark=str(mark)))
    course = make(f"## A\n\n{NUMBER}")
    for number, left in ((signal.SIGINT, []), (signal.SIGKILL, [".new"])):
        mark.unlink(missing_ok=True)
        slow = course.start("check", "--against", "9.4.0", stdout=subprocess.DEVNULL)
        with kill_at_end(slow) as process:
            wait_for_file(mark)
            process.send_signal(number)
            process.wait(120)
        assert environments(course) == left
        if number is signal.SIGINT:
            wait_until_alone(course)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with (
        kill_at_end(course.start("check", "--against", NEW_VERSION, **pipes)) as first,
        kill_at_end(course.start("check", "--against", NEW_VERSION, **pipes)) as second,
    ):
        outputs = [process.communicate(timeout=900) for process in (first, second)]
    assert outputs[0][0] == outputs[1][0] != b""
    errors = b"".join(error for _, error in outputs)
    assert errors.count(b"installing MuJoCo " + NEW_VERSION.encode()) == 1
    assert environments(course) == sorted((VERSION, NEW_VERSION)), (
        "what the killed one left is gone"
    )


def test_only_the_environments_used_last_stay(make: Make, wheels: Path, installed: Path) -> None:
    course = borrow(make(f"## A\n\n{PLAIN}"), installed, NEW_VERSION)
    for number in range(5):
        old = environments_folder() / f"mujoco-8.{number}-x"
        old.mkdir(parents=True)
        os.utime(old, (number, number))
    assert check_against(course, "-q").status == 0
    assert environments(course) == ["8.2", "8.3", "8.4", NEW_VERSION]


@pytest.mark.usefixtures("wheels")
def test_pip_starts_no_compiler_to_say_its_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rustc = tmp_path / "bin/rustc"
    rustc.parent.mkdir()
    rustc.write_text('#!/bin/sh\necho "$0" > "$0.called"\n')
    rustc.chmod(0o755)
    monkeypatch.setenv("PATH", f"{rustc.parent}:{os.environ['PATH']}")
    assert latest_version() == NEW_VERSION
    assert [path.name for path in rustc.parent.iterdir()] == ["rustc"]
