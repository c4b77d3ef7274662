"""Every dependency has one exact version, and the places that name it agree."""

import importlib.metadata
import json
import re
import runpy
from pathlib import Path

EXACT = re.compile(r"\d+\.\d+\.\d+")


def requirements(pyproject: dict) -> dict[str, str]:
    project = pyproject["project"]
    declared = [
        *pyproject["build-system"]["requires"],
        *project["dependencies"],
        *(line for extra in project["optional-dependencies"].values() for line in extra),
    ]
    split = [line.split("==") for line in declared]
    assert [parts for parts in split if len(parts) != 2] == []
    pins: dict[str, str] = {}
    for name, version in split:
        assert pins.setdefault(name, version) == version, f"{name} has two versions"
    return pins


def lock(root: Path) -> dict:
    return json.loads((root / "site" / "package-lock.json").read_text(encoding="utf-8"))


def manifest(root: Path) -> dict:
    return json.loads((root / "site" / "package.json").read_text(encoding="utf-8"))


def test_python_requirements_are_exact_and_installed(pyproject: dict) -> None:
    pins = requirements(pyproject)
    assert pins["mujoco"] == "3.14.0"
    installed = {name: importlib.metadata.version(name) for name in pins}
    assert installed == pins


def test_the_node_for_builds_is_the_declared_one(root: Path, pyproject: dict) -> None:
    name, version = runpy.run_path(str(root / "site" / "bundle.py"))["NODE_REQUIREMENT"].split("==")
    assert requirements(pyproject)[name] == version


def test_fonts_are_cut_when_bundling_with_what_cuts_them_later(root: Path, pyproject: dict) -> None:
    needed = runpy.run_path(str(root / "site" / "bundle.py"))["AHEAD_REQUIREMENTS"]
    assert {*needed} <= {*pyproject["project"]["dependencies"]}


def test_npm_requirements_are_exact(root: Path) -> None:
    declared = manifest(root)
    versions = declared["dependencies"] | declared["devDependencies"]
    assert {name: v for name, v in versions.items() if not EXACT.fullmatch(v)} == {}
    top = lock(root)["packages"][""]
    assert top["dependencies"] == declared["dependencies"]
    assert top["devDependencies"] == declared["devDependencies"]


def test_lock_holds_checksums_and_no_addresses(root: Path) -> None:
    text = (root / "site" / "package-lock.json").read_text(encoding="utf-8")
    assert "resolved" not in text
    assert "://" not in text
    packages = {path: entry for path, entry in lock(root)["packages"].items() if path}
    assert len(packages) > 8
    without = [path for path, entry in packages.items() if "sha512-" not in entry["integrity"]]
    assert without == []


def test_lock_stays_without_addresses_when_npm_writes_it(root: Path) -> None:
    settings = (root / "site" / ".npmrc").read_text(encoding="utf-8").splitlines()
    assert "omit-lockfile-registry-resolved=true" in settings


def test_the_table_of_dependencies_is_complete(root: Path, pyproject: dict) -> None:
    declared = manifest(root)
    wanted = requirements(pyproject) | declared["dependencies"] | declared["devDependencies"]
    table = (root / "docs/explanation/dependencies.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([^`]+)` \| ([^ |]+) \|", table, flags=re.MULTILINE)
    assert sorted(rows) == sorted(wanted.items())
