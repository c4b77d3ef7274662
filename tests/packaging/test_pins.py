"""Required and locked versions agree, and every locked package has its hashes."""

import importlib.metadata
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

EXACT = re.compile(r"\d+\.\d+\.\d+")
LOCKED = re.compile(r"^(\S+ ?;?.*?) \\\n    --hash=sha256:[0-9a-f]{64}", re.MULTILINE)


def versions(lock: str) -> dict[str, str]:
    """The locked versions that are for this machine."""
    return {
        requirement.name: next(iter(requirement.specifier)).version
        for requirement in map(Requirement, LOCKED.findall(lock))
        if requirement.marker is None or requirement.marker.evaluate()
    }


def transitive_needs(lines: Iterable[str]) -> set[str]:
    """What these requirements need on this machine, by what is installed."""
    packages, queue = set(), [*map(Requirement, lines)]
    while queue:
        requirement = queue.pop()
        for extra in ("", *requirement.extras):
            if (requirement.name, extra) not in packages:
                packages.add((requirement.name, extra))
                needs = map(Requirement, importlib.metadata.requires(requirement.name) or ())
                queue += [
                    need
                    for need in needs
                    if need.marker is None or need.marker.evaluate({"extra": extra})
                ]
    return {canonicalize_name(name) for name, _ in packages}


def locked_requirements(root: Path, pyproject: dict) -> list[str]:
    """What is declared here and by the packages of this repository, but for these packages."""
    local = pyproject["tool"]["uv"]["sources"]
    lines = declared_requirements(pyproject)
    for source in local.values():
        text = (root / source["path"] / "pyproject.toml").read_text(encoding="utf-8")
        lines += declared_requirements(tomllib.loads(text))
    ours = {"coursebuild", *local}
    return [line for line in lines if Requirement(line).name not in ours]


def declared_requirements(pyproject: dict) -> list[str]:
    project, groups = pyproject["project"], pyproject.get("dependency-groups", {})
    extras = project.get("optional-dependencies", {}).values()
    lines = [*project["dependencies"], *(line for extra in extras for line in extra)]
    return lines + [line for group in groups.values() for line in group if isinstance(line, str)]


def lock(root: Path) -> dict:
    return json.loads((root / "site" / "package-lock.json").read_text(encoding="utf-8"))


def manifest(root: Path) -> dict:
    return json.loads((root / "site" / "package.json").read_text(encoding="utf-8"))


def test_packages_are_asked_for_between_two_bounds(pyproject: dict) -> None:
    for line in pyproject["project"]["dependencies"]:
        operators = sorted(specifier.operator for specifier in Requirement(line).specifier)
        assert operators in (["<", ">="], ["<=", ">="]), line


def test_the_lock_holds_what_is_declared_and_what_is_installed(root: Path, pyproject: dict) -> None:
    """After a change of pyproject.toml: make lock."""
    all_versions = versions((root / "requirements.lock").read_text(encoding="utf-8"))
    for requirement in map(Requirement, locked_requirements(root, pyproject)):
        version = all_versions[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), requirement
        assert importlib.metadata.version(requirement.name) == version


def test_what_is_taken_from_the_lock_is_what_was_asked_for_and_what_that_needs(
    root: Path, pyproject: dict
) -> None:
    requirements = pyproject["project"]["dependencies"] + pyproject["dependency-groups"]["build"]
    command = (sys.executable, "-I", "-S", str(root / "site/locked.py"), "build")
    part = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert {*versions(part)} == transitive_needs(requirements)


def test_the_lock_names_no_address(root: Path) -> None:
    text = (root / "requirements.lock").read_text(encoding="utf-8")
    assert "://" not in text
    assert len(LOCKED.findall(text)) == len(re.findall(r"^\w", text, re.MULTILINE))


def test_npm_requirements_are_exact(root: Path) -> None:
    versions_declared = manifest(root)
    versions = versions_declared["dependencies"] | versions_declared["devDependencies"]
    assert {name: v for name, v in versions.items() if not EXACT.fullmatch(v)} == {}
    top = lock(root)["packages"][""]
    assert top["dependencies"] == versions_declared["dependencies"]
    assert top["devDependencies"] == versions_declared["devDependencies"]


def test_lock_holds_checksums_and_no_addresses(root: Path) -> None:
    text = (root / "site" / "package-lock.json").read_text(encoding="utf-8")
    assert "resolved" not in text
    assert "://" not in text
    packages = {path: entry for path, entry in lock(root)["packages"].items() if path}
    assert len(packages) > 8
    without_checksum = [
        path for path, entry in packages.items() if "sha512-" not in entry["integrity"]
    ]
    assert without_checksum == []


def test_lock_stays_without_addresses_when_npm_writes_it(root: Path) -> None:
    settings = (root / "site" / ".npmrc").read_text(encoding="utf-8").splitlines()
    assert "omit-lockfile-registry-resolved=true" in settings


def test_what_each_package_is_for_is_said_once(root: Path, pyproject: dict) -> None:
    npm = manifest(root)
    names = {*npm["dependencies"], *npm["devDependencies"]}
    names |= {Requirement(line).name for line in locked_requirements(root, pyproject)}
    names |= set(pyproject["tool"]["uv"]["sources"])
    page = (root / "docs/explanation/dependencies.md").read_text(encoding="utf-8")
    (packages,) = re.findall(r"^## Packages$(.*?)^## ", page, re.DOTALL | re.MULTILINE)
    table, _, list_for_work = packages.partition("### Only for work on coursebuild")
    places = re.findall(r"^\| `([^`]+)` \| ", table, re.MULTILINE)
    places += re.findall(r"`([\w-]+)`\s\(", list_for_work)
    text = (root / "pyproject.toml").read_text(encoding="utf-8")
    (group,) = re.findall(r"^dev = \[$(.*?)^\]", text, re.DOTALL | re.MULTILINE)
    places += re.findall(r'^    "([\w-]+).*", # ', group, re.MULTILINE)
    assert sorted(places) == sorted(names)
