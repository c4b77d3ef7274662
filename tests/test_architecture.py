"""The imports of the packages form the DAG that DESIGN names, and the start-up path stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import coursebuild

PACKAGE = Path(coursebuild.__file__).parent
ROOT = PACKAGE.parent

LAYERS: tuple[frozenset[str], ...] = (
    frozenset({"values", "patterns"}),
    frozenset({"source", "drawing", "python_text"}),
    frozenset({"rules"}),
    frozenset({"diagnostics"}),
    frozenset({"model"}),
    frozenset({"results", "vocabulary", "measured"}),
    frozenset({"syntax", "checks", "scripts", "labs", "render", "physics", "report", "effects"}),
    frozenset({"pipeline"}),
    frozenset({"cli"}),
    frozenset({"__main__"}),
)
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
FILES = sorted(PACKAGE.rglob("*.py"))


def part_of(path: Path) -> str:
    relative = path.relative_to(PACKAGE).parts
    return relative[0].removesuffix(".py")


def imports_of(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.add(node.module or "")
            if node.module == "coursebuild":
                found |= {f"coursebuild.{alias.name}" for alias in node.names}
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_down_and_never_sideways(path: Path) -> None:
    own = part_of(path)
    if own == "__init__":
        return
    for name in imports_of(path):
        package, _, rest = name.partition(".")
        if package == "mjcourse":
            raise AssertionError(f"{own} imports mjcourse, which is for lesson scripts")
        other = rest.split(".")[0]
        if package != "coursebuild" or other in ("", own, "__version__"):
            continue
        assert LEVEL[other] < LEVEL[own], f"{path.name}: {own} must not import {other}"


def test_every_part_has_its_place() -> None:
    assert {part_of(path) for path in FILES} - {"__init__"} <= set(LEVEL)


def test_mjcourse_never_imports_coursebuild() -> None:
    for path in sorted((ROOT / "mjcourse").rglob("*.py")):
        assert not {name for name in imports_of(path) if name.split(".")[0] == "coursebuild"}, path


IO_MODULES = {
    "os",
    "shutil",
    "socket",
    "subprocess",
    "tempfile",
    "urllib.request",
    "http.server",
    "multiprocessing",
    "signal",
}
PURE = (
    *("syntax", "checks", "scripts", "labs", "physics", "render", "report", "model"),
    *("drawing", "measured"),
)


@pytest.mark.parametrize(
    "path", [p for p in FILES if part_of(p) in PURE], ids=lambda path: str(path.relative_to(ROOT))
)
def test_pure_parts_import_nothing_that_does_io(path: Path) -> None:
    assert not imports_of(path) & IO_MODULES
    calls = {
        node.func.id
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert not calls & {"open", "print", "input"}


def test_asking_for_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from coursebuild.cli import main\n"
        "try: main(['--version'])\n"
        "except SystemExit: pass\n"
        "print(sorted(set(sys.modules) & {'numpy', 'mujoco', 'markdown_it', 'jinja2', 'pygments',"
        " 'msgspec', 'coursebuild.effects.v8_library', 'fontTools', 'uharfbuzz', 'watchfiles'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_stay_small_and_say_what_they_are_for(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= 450, "split it"
    assert ast.get_docstring(ast.parse(text)), "a module says its purpose"
