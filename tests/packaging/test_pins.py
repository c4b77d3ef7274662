"""What is asked for and what is locked agree, and every package that is locked has its hashes."""

import importlib.metadata
import json
import re
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

EXACT = re.compile(r"\d+\.\d+\.\d+")
LOCKED = re.compile(r"^(\S+ ?;?.*?) \\\n    --hash=sha256:[0-9a-f]{64}", re.MULTILINE)
LOCKS = ("requirements.txt", "requirements-build.txt", "requirements-dev.txt")


def locked(root: Path, name: str) -> Iterator[Requirement]:
    """The packages of a lock that are installed on this machine."""
    text = (root / name).read_text(encoding="utf-8")
    for line in LOCKED.findall(text):
        one = Requirement(line)
        if one.marker is None or one.marker.evaluate():
            yield one


def versions(root: Path, name: str) -> dict[str, str]:
    return {one.name: next(iter(one.specifier)).version for one in locked(root, name)}


def declared(pyproject: dict) -> list[str]:
    """What the package asks for, and what work on it does."""
    project, groups = pyproject["project"], pyproject["dependency-groups"]
    extras = project["optional-dependencies"].values()
    lines = [*project["dependencies"], *(line for extra in extras for line in extra)]
    return lines + [line for group in groups.values() for line in group if isinstance(line, str)]


def lock(root: Path) -> dict:
    return json.loads((root / "site" / "package-lock.json").read_text(encoding="utf-8"))


def manifest(root: Path) -> dict:
    return json.loads((root / "site" / "package.json").read_text(encoding="utf-8"))


def test_packages_are_asked_for_between_two_bounds(pyproject: dict) -> None:
    for line in pyproject["project"]["dependencies"]:
        operators = sorted(one.operator for one in Requirement(line).specifier)
        assert operators in (["<", ">="], ["<=", ">="]), line


def test_locks_hold_what_is_declared_and_what_is_installed(root: Path, pyproject: dict) -> None:
    """After a change of pyproject.toml: make lock."""
    everything = versions(root, "requirements-dev.txt")
    for name in LOCKS[:2]:
        assert versions(root, name).items() <= everything.items()
    for one in map(Requirement, declared(pyproject)):
        version = everything[canonicalize_name(one.name)]
        assert one.specifier.contains(version), one
        assert importlib.metadata.version(one.name) == version
    runtime = {canonicalize_name(Requirement(x).name) for x in pyproject["project"]["dependencies"]}
    assert runtime <= set(versions(root, "requirements.txt"))


def test_locks_name_no_address(root: Path) -> None:
    for name in LOCKS:
        text = (root / name).read_text(encoding="utf-8")
        assert "://" not in text
        assert len(LOCKED.findall(text)) == len(re.findall(r"^\w", text, re.MULTILINE)), name


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
    npm = manifest(root)
    wanted = {*npm["dependencies"].items(), *npm["devDependencies"].items()}
    for line in declared(pyproject):
        name = Requirement(line).name
        wanted.add((name, line.partition(";")[0].removeprefix(name) or "locked"))
    table = (root / "docs/explanation/dependencies.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([^`]+)` \| ([^ |]+) \|", table, flags=re.MULTILINE)
    assert sorted(rows) == sorted(wanted)
