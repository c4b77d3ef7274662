"""What is in the wheel and in the source distribution, and that both can be built again."""

import email
import importlib.metadata
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packaging.requirements import Requirement

from coursebuild import REPOSITORY, SITE

Run = Callable[..., subprocess.CompletedProcess[str]]
Copy = Callable[..., Path]
Build = Callable[[Path, str], Path]

pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def archive(wheel: Path) -> Iterator[zipfile.ZipFile]:
    with zipfile.ZipFile(wheel) as file:
        yield file


@pytest.fixture(scope="module")
def names(archive: zipfile.ZipFile) -> list[str]:
    return archive.namelist()


def files_below(folder: Path, pattern: str = "*") -> set[str]:
    paths = (path for path in folder.rglob(pattern) if path.is_file())
    return {p.relative_to(folder).as_posix() for p in paths if "__pycache__" not in p.parts}


@pytest.mark.long
def test_wheel_holds_packages_templates_and_scripts_and_nothing_beside_them(
    root: Path, archive: zipfile.ZipFile, names: list[str], full_name: str
) -> None:
    code = {f"{part}/{p}" for part in ("coursebuild", "mjcourse") for p in files_below(root / part)}
    templates = {f"coursebuild/templates/{path}" for path in files_below(root / "templates")}
    assert {name for name in names if name.startswith("coursebuild/templates/")} == templates
    ends, prefix = (".py", "/py.typed"), "coursebuild/assets/"
    names_there = {name for name in names if name.endswith(ends) and prefix not in name}
    assert names_there == {name for name in code | templates if name.endswith(ends)}
    dist = root / "site" / "dist"
    assets = {name.removeprefix(prefix): archive.read(name) for name in names if prefix in name}
    bundled = files_below(dist) - {"stamp.json", "coursebuild.cdx.json"}
    assert assets == {path: (dist / path).read_bytes() for path in bundled}
    assert {path for path in code if path.endswith(".js")} <= {*names}
    lock = (root / "requirements.lock").read_bytes()
    assert archive.read("coursebuild/locks/requirements.lock") == lock
    tops = {name.split("/")[0] for name in names}
    assert tops == {"coursebuild", "mjcourse", f"{full_name}.dist-info"}
    assert len(names) == len(set(names))
    strays = re.compile(r"node_modules|\.pyc$|stamp\.json|package(-lock)?\.json|\.mjs$|/\.")
    assert [name for name in names if strays.search(name)] == []


def test_every_shipped_package_has_its_licence(
    archive: zipfile.ZipFile, names: list[str], full_name: str
) -> None:
    prefix = "coursebuild/assets/licences/"
    texts = {name.removeprefix(prefix): archive.read(name) for name in names if prefix in name}
    assert {
        "fontsource-stix-two-math.txt",
        "fontsource-variable-source-code-pro.txt",
        "fontsource-variable-source-sans-3.txt",
        "fontsource-variable-source-serif-4.txt",
        "mujoco-mujoco.txt",
        "temml.txt",
    } <= set(texts)
    assert all(len(text) > 500 for text in texts.values())
    for name, text in texts.items():
        if name.startswith("fontsource-"):
            assert b"SIL OPEN FONT LICENSE" in text
    assert b"Apache License" in archive.read(f"{full_name}.dist-info/licenses/LICENSE")


def test_bill_of_materials_lists_every_package_of_which_something_is_shipped(
    archive: zipfile.ZipFile, names: list[str], full_name: str, pyproject: dict
) -> None:
    text = archive.read(f"{full_name}.dist-info/sboms/coursebuild.cdx.json").decode()
    assert JsonStrictValidator(SchemaVersion.V1_7).validate_str(text) is None
    bill = json.loads(text)
    shipped = [package for package in bill["components"] if not package.get("isExternal")]
    licences = {f"{package['name'].removeprefix('@').replace('/', '-')}.txt" for package in shipped}
    prefix = "coursebuild/assets/licences/"
    assert licences == {name.removeprefix(prefix) for name in names if name.startswith(prefix)}
    engine = next(package for package in shipped if package["name"] == "@mujoco/mujoco")
    assert engine["purl"] == f"pkg:npm/%40mujoco/mujoco@{importlib.metadata.version('mujoco')}"
    assert engine["licenses"] == [{"expression": "Apache-2.0"}]
    assert re.fullmatch("[0-9a-f]{128}", engine["hashes"][0]["content"])
    python_packages = {
        package["name"] for package in bill["components"] if package.get("isExternal")
    }
    requirements = map(Requirement, pyproject["project"]["dependencies"])
    assert {package.name.lower() for package in requirements} <= python_packages


def test_metadata_names_the_command_and_the_ranges(
    archive: zipfile.ZipFile, pyproject: dict, full_name: str
) -> None:
    info = f"{full_name}.dist-info"
    metadata = email.message_from_bytes(archive.read(f"{info}/METADATA"))
    assert metadata["License-Expression"] == "Apache-2.0"
    assert metadata["Requires-Python"] == ">=3.11"
    required = [line for line in metadata.get_all("Requires-Dist") if "extra ==" not in line]
    requirements = {str(Requirement(line)) for line in pyproject["project"]["dependencies"]}
    assert {str(Requirement(line)).lower() for line in required} == set(
        map(str.lower, requirements)
    )
    links = metadata.get_all("Project-URL") or []
    assert bool(links) == bool(REPOSITORY or SITE), "a repository without an owner has no address"
    assert [link for link in links if "OWNER" in link or "//example." in link] == []
    points = archive.read(f"{info}/entry_points.txt").decode()
    for line in (
        "coursebuild = coursebuild.cli:main",
        "coursebuild = coursebuild.cli.pytest_plugin",
    ):
        assert line in points


def test_sdist_holds_the_sources_and_what_was_bundled(root: Path, sdist: Path) -> None:
    with tarfile.open(sdist) as archive:
        files = {m.name.split("/", 1)[1] for m in archive.getmembers() if m.isfile()}
    site = {"bundle.py", "build.mjs", "package.json", "package-lock.json", ".npmrc"}
    sources = {
        f"{part}/{p}" for part in ("coursebuild", "mjcourse") for p in files_below(root / part)
    }
    assert {f"site/{name}" for name in site} | sources <= files
    for folder in ("templates", "site/js", "site/css", "content", "models"):
        assert {f"{folder}/{path}" for path in files_below(root / folder)} <= files
    assert {"hatch_build.py", "LICENSE", "README.md", "Makefile", "PKG-INFO"} <= files
    assert {f"site/dist/{path}" for path in files_below(root / "site" / "dist")} <= files
    strays = re.compile(r"node_modules|\.venv|__pycache__|\.bundle")
    assert [name for name in files if strays.search(name)] == []


def test_sdist_needs_neither_node_nor_packages_to_become_the_wheel(
    wheel: Path, sdist: Path, run: Run, tmp_path: Path, full_name: str
) -> None:
    """Only Python is on PATH, and the build requires nothing besides hatchling."""
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    code = (
        "import hatchling.build as b; print(b.get_requires_for_build_wheel(), b.build_wheel('.'))"
    )
    result = run(sys.executable, "-c", code, cwd=tmp_path / full_name, path=tmp_path)
    assert result.stdout.split() == ["[]", wheel.name], result.stderr
    assert (tmp_path / full_name / wheel.name).read_bytes() == wheel.read_bytes()


@pytest.mark.slow
def test_archives_bundled_anew_in_another_folder_are_the_same(
    wheel: Path, sdist: Path, copy_project: Copy, build: Build, tmp_path: Path
) -> None:
    elsewhere = copy_project(tmp_path / "a" / "b c", bundled=False)
    assert build(elsewhere, "wheel").read_bytes() == wheel.read_bytes()
    assert build(elsewhere, "sdist").read_bytes() == sdist.read_bytes()
