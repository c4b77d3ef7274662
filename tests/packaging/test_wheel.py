"""What is in the wheel and in the source distribution, and that both can be built again."""

import email
import importlib.metadata
import io
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import py_mini_racer
import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from fontTools.ttLib import TTFont
from packaging.requirements import Requirement

Run = Callable[..., subprocess.CompletedProcess[str]]
Copy = Callable[..., Path]
Build = Callable[[Path, str], Path]

pytestmark = pytest.mark.site

SAMPLES = {
    "latin": "AZaz09 é×÷±²−“”…",
    "latin-ext": "ĀčłŐŽ",
    "vietnamese": "ăĐơưẠỹ",
    "greek": "ΑΩαβγδθλμπσφω",
    "cyrillic": "АЯаяёі",
}


@pytest.fixture(scope="module")
def archive(wheel: Path) -> Iterator[zipfile.ZipFile]:
    with zipfile.ZipFile(wheel) as found:
        yield found


@pytest.fixture(scope="module")
def names(archive: zipfile.ZipFile) -> list[str]:
    return archive.namelist()


def below(folder: Path, pattern: str = "*") -> set[str]:
    paths = (path for path in folder.rglob(pattern) if path.is_file())
    return {p.relative_to(folder).as_posix() for p in paths if "__pycache__" not in p.parts}


def test_wheel_holds_packages_templates_and_scripts_and_nothing_beside_them(
    root: Path, archive: zipfile.ZipFile, names: list[str], full_name: str
) -> None:
    code = {f"{part}/{p}" for part in ("coursebuild", "mjcourse") for p in below(root / part)}
    templates = {f"coursebuild/templates/{path}" for path in below(root / "templates")}
    assert {name for name in names if name.startswith("coursebuild/templates/")} == templates
    ends = (".py", "/py.typed")
    there = {name for name in names if name.endswith(ends)}
    assert there == {name for name in code | templates if name.endswith(ends)}
    scripts = {p.name for p in (root / "site/js").glob("*.js") if not p.name.endswith(".test.js")}
    assert {n.rsplit("/", 1)[1] for n in names if n.startswith("coursebuild/assets/js/")} == scripts
    assert {
        f"coursebuild/core/run/{p.name}" for p in (root / "coursebuild/core/run").glob("*.js")
    } <= {*names}
    style = archive.read("coursebuild/assets/css/site.css").decode()
    assert "{" in style and "@import" not in style
    tops = {name.split("/")[0] for name in names}
    assert tops == {"coursebuild", "mjcourse", f"{full_name}.dist-info"}
    assert len(names) == len(set(names))
    strays = re.compile(r"node_modules|\.pyc$|stamp\.json|package(-lock)?\.json|\.mjs$|/\.")
    assert [name for name in names if strays.search(name)] == []


def test_fonts_are_what_their_list_says(archive: zipfile.ZipFile, names: list[str]) -> None:
    prefix = "coursebuild/assets/fonts/"
    faces = json.loads(archive.read(f"{prefix}fonts.json"))
    files = {name.removeprefix(prefix) for name in names if name.startswith(prefix)}
    assert sorted(face["file"] for face in faces) == sorted(files - {"fonts.json"})
    for face in faces:
        font = TTFont(io.BytesIO(archive.read(prefix + face["file"])))
        characters = set(map(chr, font.getBestCmap()))
        assert set(SAMPLES[face["subset"]]) <= characters, face["file"]
        assert (face["style"] == "italic") == bool(font["head"].macStyle & 2), face["file"]
        if face["unicode_range"] is None:
            assert "MATH" in font
            assert set("∫√∂∇⟨≈") <= characters
        else:
            axis = next(axis for axis in font["fvar"].axes if axis.axisTag == "wght")
            assert face["weight"] == [axis.minValue, axis.maxValue]
    families = {face["family"]: face["style"] for face in faces}
    assert len(families) == 3


def test_temml_is_a_classic_script_for_an_engine_without_a_page(archive: zipfile.ZipFile) -> None:
    engine = py_mini_racer.MiniRacer()
    engine.eval(archive.read("coursebuild/assets/temml/temml.min.js").decode())
    markup = engine.eval(r"temml.renderToString('\\frac{1}{2}\\dot{x}^2')")
    assert "<mfrac>" in markup


@pytest.mark.engine
def test_the_physics_engine_runs_without_a_page(archive: zipfile.ZipFile) -> None:
    engine = py_mini_racer.MiniRacer()
    engine.eval(archive.read("coursebuild/assets/js/lab-trial.js").decode())
    wasm = archive.read("coursebuild/assets/mujoco/mujoco.wasm")
    engine.eval(f"reserve('wasm', {len(wasm)})")[:] = wasm
    engine.eval("boot('')")
    assert engine.eval("booted('')") == importlib.metadata.version("mujoco")


def test_every_shipped_package_has_its_licence(
    archive: zipfile.ZipFile, names: list[str], full_name: str
) -> None:
    prefix = "coursebuild/assets/licences/"
    texts = {name.removeprefix(prefix): archive.read(name) for name in names if prefix in name}
    assert {
        "fontsource-stix-two-math.txt",
        "fontsource-variable-source-code-pro.txt",
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
    shipped = [one for one in bill["components"] if not one.get("isExternal")]
    licences = {f"{one['name'].removeprefix('@').replace('/', '-')}.txt" for one in shipped}
    prefix = "coursebuild/assets/licences/"
    assert licences == {name.removeprefix(prefix) for name in names if name.startswith(prefix)}
    engine = next(one for one in shipped if one["name"] == "@mujoco/mujoco")
    assert engine["purl"] == f"pkg:npm/%40mujoco/mujoco@{importlib.metadata.version('mujoco')}"
    assert engine["licenses"] == [{"expression": "Apache-2.0"}]
    assert re.fullmatch("[0-9a-f]{128}", engine["hashes"][0]["content"])
    beside = {one["name"] for one in bill["components"] if one.get("isExternal")}
    declared = map(Requirement, pyproject["project"]["dependencies"])
    assert {one.name.lower() for one in declared} <= beside


def test_metadata_names_the_command_and_the_ranges(
    archive: zipfile.ZipFile, pyproject: dict, full_name: str
) -> None:
    info = f"{full_name}.dist-info"
    metadata = email.message_from_bytes(archive.read(f"{info}/METADATA"))
    assert metadata["License-Expression"] == "Apache-2.0"
    assert metadata["Requires-Python"] == ">=3.11"
    required = [line for line in metadata.get_all("Requires-Dist") if "extra ==" not in line]
    declared = {str(Requirement(line)) for line in pyproject["project"]["dependencies"]}
    assert {str(Requirement(line)).lower() for line in required} == set(map(str.lower, declared))
    urls = dict(line.split(", ") for line in metadata.get_all("Project-URL"))
    assert urls == pyproject["project"]["urls"]
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
    sources = {f"{part}/{p}" for part in ("coursebuild", "mjcourse") for p in below(root / part)}
    assert {f"site/{name}" for name in site} | sources <= files
    for folder in ("templates", "site/js", "site/css", "content", "models"):
        assert {f"{folder}/{path}" for path in below(root / folder)} <= files
    assert {"hatch_build.py", "LICENSE", "README.md", "Makefile", "PKG-INFO"} <= files
    assert {f"site/dist/{path}" for path in below(root / "site" / "dist")} <= files
    strays = re.compile(r"node_modules|\.venv|__pycache__|\.bundle")
    assert [name for name in files if strays.search(name)] == []


def test_sdist_needs_neither_node_nor_packages_to_become_the_wheel(
    wheel: Path, sdist: Path, run: Run, tmp_path: Path, full_name: str
) -> None:
    """Only Python is on PATH, and the build asks for nothing besides hatchling."""
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    code = (
        "import hatchling.build as b; print(b.get_requires_for_build_wheel(), b.build_wheel('.'))"
    )
    done = run(sys.executable, "-c", code, cwd=tmp_path / full_name, path=tmp_path)
    assert done.stdout.split() == ["[]", wheel.name], done.stderr
    assert (tmp_path / full_name / wheel.name).read_bytes() == wheel.read_bytes()


@pytest.mark.slow
def test_archives_bundled_anew_in_another_folder_are_the_same(
    wheel: Path, sdist: Path, copy_project: Copy, build: Build, tmp_path: Path
) -> None:
    elsewhere = copy_project(tmp_path / "a" / "b c", bundled=False)
    assert build(elsewhere, "wheel").read_bytes() == wheel.read_bytes()
    assert build(elsewhere, "sdist").read_bytes() == sdist.read_bytes()
