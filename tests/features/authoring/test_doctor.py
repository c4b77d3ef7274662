"""What works on this machine: a line for each thing, and a cure where it does not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from support.scratch_course import ROOT, Folder

pytestmark = [pytest.mark.site, pytest.mark.engine]


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
        "ok       # fonts and # templates of pages\n",
        "GiB free on the disk\n",
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
        "         help: it takes Bubblewrap 0.8 or newer, and user namespaces: on Ubuntu, "
        "`sudo sysctl kernel.apparmor_restrict_unprivileged_userns=0` allows them; containers "
        "often forbid them\n"
    )
    assert result.status == 0


def test_doctor_fails_where_a_course_cannot_be_built(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.tmp.mkdir()
    folder.write("broken/mujoco/__init__.py", "raise ImportError('no library')\n")
    result = folder.run("doctor", env={"PYTHONPATH": f"{folder.root}/broken:{ROOT}"})
    assert (result.status, result.err) == (1, "")
    assert re.search(r"^broken   MuJoCo [\d.]+: ImportError: no library$", result.out, re.MULTILINE)
    assert (
        "\n         help: install coursebuild again, into an environment of its own\n" in result.out
    )
    result = folder.main("doctor", "-C", "no/such")
    assert (result.status, result.err) == (2, "coursebuild: there is no folder no/such\n")
