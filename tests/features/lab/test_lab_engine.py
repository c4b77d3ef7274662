"""Labs run in the browser's MuJoCo, whichever other version is installed for scripts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from coursebuild.core.run.packages import site_folders
from coursebuild.features.lab.engines.native import LAB_ENGINE
from support.lab_lessons import RIGHT, course, fence
from support.lab_values import Bench, make_lab
from support.scratch_course import ROOT, Folder

pytestmark = pytest.mark.engine

OTHER = "99.1.0"
"""The version that the tool takes the installed MuJoCo for."""
PREFIX = (
    "from pathlib import Path\n"
    "from coursebuild.core.run.packages import environment_prefix\n"
    f"print(environment_prefix(Path({{!r}}), {LAB_ENGINE!r}))"
)


@pytest.fixture
def folder(tmp_path: Path, stores: Path) -> Folder:
    return course(tmp_path / "course", stores, "## Lab\n\n" + fence(RIGHT))


@pytest.fixture
def variables(tmp_path: Path) -> dict[str, str]:
    """Variables under which another MuJoCo is installed, and pip finds none."""
    info = tmp_path / "packages" / f"mujoco-{OTHER}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: mujoco\nVersion: {OTHER}\n")
    return {
        "PYTHONPATH": f"{info.parent}{os.pathsep}{ROOT}",
        "XDG_STATE_HOME": str(tmp_path / "state"),
        "COURSEBUILD_STORE_KEY": "a key",
        "PIP_NO_INDEX": "1",
    }


def test_version_is_that_of_the_bundled_engine(tmp_path: Path) -> None:
    packages = json.loads((ROOT / "site/package.json").read_text())["dependencies"]
    assert packages["@mujoco/mujoco"] == LAB_ENGINE
    with Bench(tmp_path) as bench:
        assert bench.trial(make_lab())["version"] == LAB_ENGINE


@pytest.mark.long
def test_other_mujoco_of_scripts_leaves_labs_to_an_environment_of_their_own(
    folder: Folder, variables: dict[str, str]
) -> None:
    code = PREFIX.format(str(folder.root))
    prefix = subprocess.check_output(
        [sys.executable, "-c", code], env=folder.environment(variables), text=True
    ).strip()
    venv.create(prefix, symlinks=True)
    packages = next(Path(prefix, "lib").glob("python*/site-packages"))
    lines = (f"import site; site.addsitedir({path!r})\n" for path in site_folders())
    (packages / "here.pth").write_text("".join(lines))
    result = folder.run("build", env=variables)
    assert result.status == 0, result.out + result.err
    (page,) = folder.root.glob("public/lessons/1.2-*.html")
    assert f"Tried with MuJoCo {LAB_ENGINE} in the browser" in page.read_text()


def test_without_network_it_is_said_what_is_missing(
    folder: Folder, variables: dict[str, str]
) -> None:
    result = folder.run("check", env=variables)
    python = "{}.{}".format(*sys.version_info)
    assert result.status == 1
    assert f"coursebuild: pip finds no MuJoCo {LAB_ENGINE} for Python {python} on " in result.err
    assert "\n  help: without a network, point pip to a folder of wheels" in result.err
