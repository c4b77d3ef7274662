"""`coursebuild check --against`, with packages from a folder in the place of an index."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.run.versions import engine_version
from support.scratch_course import Done, Folder, block, ended, wait_until_alone

pytestmark = pytest.mark.site

HERE = engine_version()
OTHER = "9.1.0"
REAL_NUMBER = int("{:d}{:03d}{:03d}".format(*map(int, HERE.split("."))))
ENGINE = """\
import numpy
__version__ = "{version}"
mjVERSION_HEADER = {number}

class MjModel:
    nv = {number}
    opt = None

    @staticmethod
    def from_xml_path(path, assets):
        raise ValueError("XML Error: no such element\\nElement 'mesh', line 1")

class FatalError(Exception):
    pass
"""


@pytest.fixture
def wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with wheels of small packages, which pip looks into and nowhere else."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    for version, number in ((HERE, REAL_NUMBER), (OTHER, 9_001_000)):
        code = ENGINE.format(version=version, number=number)
        code += "def mju_isBad(x):\n    return 1\n" if version == HERE else ""
        wheel(folder, version, code)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    return folder


def wheel(folder: Path, version: str, code: str) -> None:
    """A MuJoCo as pip installs it."""
    info = f"mujoco-{version}.dist-info"
    needs = "Requires-Dist: nowhere-to-be-found\n"  # what it needs is what is installed here
    files = {
        "mujoco/__init__.py": code,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: mujoco\nVersion: {version}\n{needs}",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    files[f"{info}/RECORD"] = "".join(f"{file},,\n" for file in [*files, f"{info}/RECORD"])
    with zipfile.ZipFile(folder / f"mujoco-{version}-py3-none-any.whl", "w") as archive:
        for file, text in files.items():
            archive.writestr(file, text)


def environments(course: Folder) -> list[str]:
    folder = course.root / ".coursebuild" / "environments"
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def against(course: Folder, *more: str, version: str = OTHER) -> Done:
    return course.main("check", "--against", version, *more)


PLAIN = block("plain.py", 'print("no engine", 2.5)', "no engine 2.5")
NUMBER = block(
    "number.py",
    'import mujoco\nprint("header", mujoco.mjVERSION_HEADER)\nprint("and 1")',
    f"header {REAL_NUMBER}\nand 1",
)
FAILING = block("failing.py", "import mujoco\nmujoco.mju_isBad(1.0)\nprint(1)", "1")


def test_changed_outputs_are_told_number_by_number(
    make: Callable[..., Folder], wheels: Path
) -> None:
    course = make(f"## A\n\n{PLAIN}{NUMBER}{FAILING}")
    assert course.main("check", "-q").out == ""
    quiet, done = against(course, "-q"), against(course)
    error = abs(9_001_000 - REAL_NUMBER) / REAL_NUMBER
    assert (quiet.status, quiet.err, done.status) == (0, "", 0)
    assert quiet.out == done.out.replace("same       examples/plain.py\n\n", "")
    assert (
        done.out
        == f"""\
changed    examples/number.py  by MuJoCo {OTHER}
  content/lessons/1.1-one.md:22:8: recorded {REAL_NUMBER}; MuJoCo {OTHER} printed 9001000 \
(relative error {error:.1e}, no digit agrees)

fails      examples/failing.py  by MuJoCo {OTHER}
  content/lessons/1.1-one.md:28: `examples/failing.py` exited with status 1: AttributeError: \
module 'mujoco' has no attribute 'mju_isBad'

same       examples/plain.py

MuJoCo {OTHER} against {HERE}, Python {python()}: 3 scripts: 1 the same, \
1 changed by MuJoCo {OTHER}, 1 failing with MuJoCo {OTHER}
"""
    )
    made = environments(course)
    assert [name.rpartition("-")[0] for name in made] == [f"mujoco-{HERE}", f"mujoco-{OTHER}"]
    # A second run installs and runs nothing but what it has to see twice.
    again = against(course)
    assert again.out == done.out
    assert "installing" not in again.err
    assert again.err.count(": ok after") == 1
    assert environments(course) == made
    # Nothing of it is taken for a result of this environment.
    assert course.main("check").out.count("cached") == 4


def python() -> str:
    import sys

    return sys.version.split()[0]


def test_json_report_is_of_the_chosen_lessons(make: Callable[..., Folder], wheels: Path) -> None:
    course = make(f"## A\n\n{NUMBER}", f"## B\n\n{PLAIN}")
    done = against(course, "1.2", "--format", "json", "-q")
    told = json.loads(done.out)
    assert [(s["path"], s["status"]) for s in told["scripts"]] == [("examples/plain.py", "same")]
    assert (told["engine"], told["against"], told["models"]) == (HERE, OTHER, [])
    assert [name.split("-")[1] for name in environments(course)] == [OTHER]  # no control was needed
    told = json.loads(against(course, "--format", "json", "-q").out)
    first = told["scripts"][0]
    assert (first["status"], first["by_mujoco"], first["failure"]) == ("changed", True, None)
    (change,) = first["changes"]
    assert (change["recorded"], change["printed"]) == (str(REAL_NUMBER), "9001000")
    assert (change["path"], change["line"], change["column"]) == (course.lesson(), 12, 8)
    assert told["summary"]["changed"] == told["summary"]["same"] == 1


def test_another_cause_than_mujoco_is_not_blamed_on_it(
    make: Callable[..., Folder], wheels: Path
) -> None:
    """What depends on where MuJoCo is installed."""
    code = 'import mujoco\nprint(3.1416 - ("environments" in mujoco.__file__))'
    course = make("## A\n\n" + block("pi.py", code, "3.1416"))
    done = against(course, "-q")
    assert done.out.startswith(
        f"unclear    examples/pi.py  (it does not do in a fresh environment with MuJoCo {HERE} "
        "what it does here either)\n"
        "  content/lessons/1.1-one.md:11:1: recorded 3.1416; "
    )
    (wheels / f"mujoco-{HERE}-py3-none-any.whl").unlink()
    for folder in (course.root / ".coursebuild" / "environments").glob(f"mujoco-{HERE}-*"):
        folder.rename(course.root / "gone")
    done = against(course, "-q")
    assert done.out.startswith(
        f"unclear    examples/pi.py  (no fresh environment with MuJoCo {HERE} could be made: "
        f"pip finds no MuJoCo {HERE} for Python "
    )


def test_scripts_that_cannot_be_compared_say_why(make: Callable[..., Folder], wheels: Path) -> None:
    random = "import mujoco, os\nprint(mujoco.__version__, os.urandom(8).hex())"
    fixed = (
        f"import mujoco, os\nprint('{HERE}' if mujoco.__version__ == '{HERE}' else os.urandom(8))"
    )
    course = make(
        "## A\n\n"
        + block("drifted.py", "print(1)", "2")
        + block("volatile.py", random, "x", how="volatile")
        + block("broken.py", "raise SystemExit(3)", "x")
        + block("never.py", "print(1)", "1", info="norun")
        + block("needs.py", "print(1)", "1", info="requires=nowhere")
        + block("lottery.py", fixed, HERE)
        + block("printed.py", "import mujoco\nprint(mujoco.__version__)")
    )
    course.write("models/ball.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    course.write("models/broken.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>")
    done = against(course, "-q")
    assert "fails      models/ball.xml:1  no longer compiles: no such element" in done.out
    assert "models/broken" not in done.out
    assert done.out.endswith("; 0 of 1 MJCF text compiles there\n")
    lines = {line.split()[1]: line for line in done.out.splitlines() if "examples/" in line}
    assert lines == {
        "examples/drifted.py": "drifted    examples/drifted.py  "
        "(what is recorded is not what it prints here)",
        "examples/volatile.py": "uncompared examples/volatile.py  (its output is volatile)",
        "examples/broken.py": "uncompared examples/broken.py  (it does not run to its end here)",
        "examples/never.py": "uncompared examples/never.py  (its lesson says `norun`)",
        "examples/needs.py": "uncompared examples/needs.py  (it needs nowhere)",
        "examples/lottery.py": "unclear    examples/lottery.py  "
        "(two runs of it there did not do the same)",
        "examples/printed.py": f"changed    examples/printed.py  by MuJoCo {OTHER}",
    }


def test_wrong_combinations_of_arguments_give_2(make: Callable[..., Folder]) -> None:
    course = make(f"## A\n\n{PLAIN}")
    for more, told in (
        (("--format", "sarif"), "--against cannot be combined with --format sarif"),
        (("--shard", "1/2"), "--against cannot be combined with --shard"),
        (("--write-timings", "x"), "--against cannot be combined with --write-timings"),
        (("--against", "three"), "--against: 'three' is no version of MuJoCo, such as 3.13.0"),
        (("9.9",), "no lesson or page is called `9.9`; known: `1.1`"),
    ):
        done = against(course, *more)
        assert (done.status, done.out, done.err) == (2, "", f"coursebuild: {told}\n")
    assert environments(course) == []
    course.write("content/course.toml", "[[")
    done = against(course)
    assert done.status == 1
    assert done.err.startswith("coursebuild: the course cannot be read: content/course.toml:1: ")


def test_latest_is_the_newest_that_pip_finds(make: Callable[..., Folder], wheels: Path) -> None:
    course = make(f"## A\n\n{NUMBER}")
    assert f"changed by MuJoCo {OTHER}" in against(course, "-q", version="latest").out
    (wheels / f"mujoco-{OTHER}-py3-none-any.whl").unlink()
    done = against(course, "-q", version="latest")
    said = f"MuJoCo {HERE} against {HERE}, Python {python()}: 0 scripts: nothing to compare\n"
    assert (done.status, done.out) == (0, said)
    (wheels / f"mujoco-{HERE}-py3-none-any.whl").unlink()
    done = against(course, "-q", version="latest")
    assert done.status == 1
    assert done.err.startswith("coursebuild: pip finds no MuJoCo at all for Python ")


def test_version_that_cannot_be_installed_leaves_nothing(
    make: Callable[..., Folder], wheels: Path
) -> None:
    course = make(f"## A\n\n{PLAIN}")
    done = against(course, "-q", version="9.0.9")
    assert done.status == 1
    assert done.err.startswith("coursebuild: pip finds no MuJoCo 9.0.9 for Python ")
    assert "\n  help: without a network let pip find the wheels in a folder" in done.err
    wheel(wheels, "9.2.0", "raise ImportError('built for another numpy')")
    done = against(course, "-q", version="9.2.0")
    assert done.err == (
        "coursebuild: MuJoCo 9.2.0 cannot be imported beside the other packages of here: "
        "ImportError: built for another numpy\n"
    )
    assert environments(course) == []


SLOW = """\
import pathlib, time
pathlib.Path({mark!r}).touch()
time.sleep(60)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_interrupted_installation_leaves_nothing(
    make: Callable[..., Folder], wheels: Path, tmp_path: Path, number: signal.Signals
) -> None:
    mark = tmp_path / "importing"
    wheel(wheels, "9.4.0", SLOW.format(mark=str(mark)))
    course = make(f"## A\n\n{PLAIN}")
    with ended(course.start("check", "--against", "9.4.0", stdout=subprocess.DEVNULL)) as process:
        until = time.monotonic() + 600
        while not mark.exists():
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.02)
        process.send_signal(number)
        process.wait(120)
    left = environments(course)
    if number is not signal.SIGKILL:
        assert left == []
        wait_until_alone(course)
        return
    assert [name.startswith(".new-") for name in left] == [True]
    assert against(course, "-q").status == 0
    assert [name.split("-")[1] for name in environments(course)] == [OTHER]


def test_two_commands_at_once_install_once(make: Callable[..., Folder], wheels: Path) -> None:
    course = make(f"## A\n\n{NUMBER}")
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with (
        ended(course.start("check", "--against", OTHER, **pipes)) as one,
        ended(course.start("check", "--against", OTHER, **pipes)) as two,
    ):
        said = [process.communicate(timeout=900) for process in (one, two)]
    assert said[0][0] == said[1][0] != b""
    errors = b"".join(error for _, error in said)
    assert errors.count(b"installing MuJoCo " + OTHER.encode()) == 1


def test_only_the_environments_used_last_stay(make: Callable[..., Folder], wheels: Path) -> None:
    course = make(f"## A\n\n{PLAIN}")
    versions = [f"9.5.{number}" for number in range(5)]
    for version in versions:
        wheel(wheels, version, "")
        assert against(course, "-q", version=version).status == 0
    assert [name.split("-")[1] for name in environments(course)] == versions[1:]
