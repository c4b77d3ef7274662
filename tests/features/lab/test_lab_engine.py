"""Labs run in the browser's MuJoCo, whichever other version is installed for scripts."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from coursebuild.core.run.script_environment import site_folders
from coursebuild.features.lab.engines.native import LAB_ENGINE
from support.lab_lessons import RIGHT, course, fence
from support.lab_values import Bench, make_lab
from support.sandboxes import require_sandbox
from support.scratch_course import ROOT, Folder, block

pytestmark = pytest.mark.engine

PLAIN = '{"model": "ball", "verify": {"seconds": 0.2}}'
"""A lab that is offered as a script, too."""
OTHER = "99.1.0"
"""The version that the tool takes the installed MuJoCo for."""
PREFIX = (
    "from pathlib import Path\n"
    "from coursebuild.core.run.environments import find_environment\n"
    f"print(find_environment(Path({{!r}}), {LAB_ENGINE!r}, locked=True).prefix)"
)


@pytest.fixture
def folder(tmp_path: Path, stores: Path) -> Folder:
    script = block("engine.py", "import mujoco\nprint(mujoco.mjPI > 3)", "True")
    return course(tmp_path / "course", stores, f"## Lab\n\n{script}{fence(RIGHT)}{fence(PLAIN)}")


@pytest.fixture
def variables(tmp_path: Path) -> dict[str, str]:
    """Variables under which another MuJoCo is installed, and pip finds none."""
    info = tmp_path / "site-packages" / f"mujoco-{OTHER}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: mujoco\nVersion: {OTHER}\n")
    (info / "top_level.txt").write_text("mujoco\n")
    return {
        "PYTHONPATH": f"{info.parent}{os.pathsep}{ROOT}",
        "XDG_STATE_HOME": str(tmp_path / "state"),
        "COURSEBUILD_STORE_KEY": "a key",
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": "",
    }


def test_version_is_that_of_the_bundled_engine(tmp_path: Path) -> None:
    packages = json.loads((ROOT / "site/package.json").read_text())["dependencies"]
    assert packages["@mujoco/mujoco"] == LAB_ENGINE
    with Bench(tmp_path) as bench:
        assert bench.trial(make_lab())["version"] == LAB_ENGINE


def install(folder: Folder, variables: dict[str, str]) -> Path:
    """Make the environment of labs, as if it had been installed there."""
    code = PREFIX.format(str(folder.root))
    prefix = Path(
        subprocess.check_output(
            [sys.executable, "-c", code], env=folder.environment(variables), text=True
        ).strip()
    )
    venv.create(prefix, symlinks=True)
    packages = next(prefix.glob("lib/python*/site-packages"))
    lines = (f"import site; site.addsitedir({path!r})\n" for path in site_folders())
    (packages / "here.pth").write_text("".join(lines))
    files = {}
    for path in (p for p in prefix.rglob("*") if p.is_symlink() or p.is_file()):
        content = f"link to {path.readlink()}" if path.is_symlink() else hash_of(path)
        files[path.relative_to(prefix).as_posix()] = content
    record = {"requirements": [f"mujoco=={LAB_ENGINE}"], "sources": [], "files": files}
    (prefix / "record.json").write_text(json.dumps(record))
    return prefix


def hash_of(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.long
def test_other_mujoco_of_scripts_leaves_labs_to_an_environment_of_their_own(
    folder: Folder, variables: dict[str, str]
) -> None:
    require_sandbox(folder.root)
    refused = folder.run("build", "--sandbox", env=variables)
    assert refused.status == 1
    prefix = install(folder, variables)
    assert refused.err.endswith(
        f"coursebuild: labs need MuJoCo {LAB_ENGINE}, {OTHER} is installed here, and with "
        f"`--sandbox` nothing is installed: {prefix} is not there\n"
        "  help: run `coursebuild doctor --install-engine` before\n"
    )
    installed = folder.run("doctor", "--install-engine", env=variables)
    assert installed.out == f"MuJoCo {LAB_ENGINE}, for labs, is installed for {prefix}/bin/python\n"
    for option in ((), ("--sandbox",)):
        folder.run("build", "--no-cache", *option, env=variables).require_success()
        (page,) = folder.root.glob("public/lessons/1.2-*.html")
        text = page.read_text()
        assert f"Tried with MuJoCo {LAB_ENGINE} in the browser" in text
        reason = f"The scripts of this page ran with MuJoCo {OTHER}; in the browser there is only"
        assert reason in text
        (offer,) = folder.root.glob("public/assets/labs/1.2-lab-2.*.json")
        assert "exportPython" in offer.read_text()


def test_engine_of_labs_with_another_hash_is_not_installed(
    folder: Folder, variables: dict[str, str], tmp_path: Path
) -> None:
    name = f"mujoco-{LAB_ENGINE}"
    with zipfile.ZipFile(tmp_path / f"{name}-py3-none-any.whl", "w") as wheel:
        metadata = f"Metadata-Version: 2.1\nName: mujoco\nVersion: {LAB_ENGINE}\n"
        wheel.writestr("mujoco/__init__.py", "")
        wheel.writestr(f"{name}.dist-info/METADATA", metadata)
        wheel.writestr(f"{name}.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
    result = folder.run("check", env={**variables, "PIP_FIND_LINKS": str(tmp_path)})
    assert result.status == 1
    assert f"coursebuild: pip cannot install MuJoCo {LAB_ENGINE}: " in result.err
    assert "DO NOT MATCH THE HASHES" in result.err
    assert list((tmp_path / "state/coursebuild/environments").iterdir()) == []


def test_without_network_it_is_said_what_is_missing(
    folder: Folder, variables: dict[str, str]
) -> None:
    for words in (("check",), ("doctor", "--install-engine")):
        result = folder.run(*words, env=variables)
        python = "{}.{}".format(*sys.version_info)
        assert result.status == 1
        assert (
            f"coursebuild: pip finds no MuJoCo {LAB_ENGINE} for Python {python} on " in result.err
        )
        assert "\n  help: without a network, point pip to a folder of wheels" in result.err
