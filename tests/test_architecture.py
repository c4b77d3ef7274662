"""Imports form the DAG of docs/explanation/architecture.md, and the start-up path stays light."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

import coursebuild
from coursebuild.core.registry import installed_features
from support.run_code import run_code

PACKAGE = Path(coursebuild.__file__).parent
ROOT = PACKAGE.parent

LAYERS: tuple[frozenset[str], ...] = (
    frozenset({"core.text", "core.drawing"}),
    frozenset({"core.model"}),
    frozenset({"core.values"}),
    frozenset({"core.syntax", "core.checks", "core.scripts", "core.pages", "core.files"}),
    frozenset({"report", "output", "core.engine"}),
    frozenset({"core.run"}),
    frozenset({"core.features"}),
    frozenset({"core.registry"}),
    frozenset({"pipeline"}),
    frozenset({"preview", "api"}),
    frozenset({"features", "cli"}),
    frozenset({"__main__"}),
)
ASK_FEATURES = {"core.syntax", "core.checks", "core.pages", "core.files", "core.engine"}
"""Parts with modules above the features, which ask these, beside others of which features are made.
That no circle comes of it is a test of its own."""
UNLAYERED_MODULES = {"__init__", "core.__init__"}
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
FILES = sorted(PACKAGE.rglob("*.py"))
BENCH_FILES = sorted((ROOT / "mjbench/mjbench").rglob("*.py"))

PURE = """
core.text core.drawing core.model core.syntax core.checks core.scripts core.pages report
""".split()
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
IO_CALLS = {"open", "print", "input"}


class Module(NamedTuple):
    """What a file says of itself; its tree is not kept, since the whole package's is large."""

    imports: frozenset[str]
    """A relative import stands here with its dots."""
    calls: frozenset[str]
    lines: int
    has_docstring: bool


@cache
def read(path: Path) -> Module:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    imports: set[str] = set()
    calls: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            names = [f"{module}.{alias.name}" for alias in node.names]
            imports |= {name if is_module(name) else module for name in names}
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            calls.add(node.func.id)
    docstring = ast.get_docstring(tree)
    return Module(frozenset(imports), frozenset(calls), text.count("\n"), bool(docstring))


def is_module(name: str) -> bool:
    path = ROOT / name.replace(".", "/")
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def part_of(path: Path) -> str:
    return part(path.relative_to(PACKAGE).with_suffix("").parts)


def part(names: tuple[str, ...]) -> str:
    """The core's folders are parts of their own."""
    return ".".join(names[: 2 if names[0] == "core" else 1])


def is_allowed(importer: str, name: str) -> bool:
    """Whether a part may import a module; `mjcourse` is for lesson scripts, `mjbench` is apart."""
    package, _, rest = name.partition(".")
    if package != "coursebuild":
        return package not in ("", "mjcourse", "mjbench")
    imported_part = part(tuple(rest.split(".")))
    if importer in ASK_FEATURES and imported_part in ("core.features", "core.registry"):
        return True
    return imported_part in ("", importer, "__version__") or LEVEL[imported_part] < LEVEL[importer]


def test_every_part_has_a_layer() -> None:
    assert {part_of(path) for path in FILES} - UNLAYERED_MODULES == set(LEVEL)


def test_imports_go_down_and_never_sideways() -> None:
    violations = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in FILES
        if part_of(path) not in UNLAYERED_MODULES
        for name in sorted(read(path).imports)
        if not is_allowed(part_of(path), name)
    ]
    assert not violations, "\n".join(violations)


def test_no_imports_turn_in_a_circle() -> None:
    """Those of types and those inside functions included."""
    imports = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): read(path)
        for path in FILES
    }
    graph = {name: module.imports & imports.keys() for name, module in imports.items()}
    tuple(TopologicalSorter(graph).static_order())  # raises CycleError, which names the circle


def test_features_import_those_alone_that_they_need() -> None:
    violations = [
        f"{path.relative_to(ROOT)} imports {name}"
        for feature in installed_features()
        for path in (PACKAGE / "features" / feature.name).rglob("*.py")
        for name in sorted(read(path).imports)
        if name.startswith("coursebuild.features.")
        and name.split(".")[2] not in (feature.name, *feature.needs)
    ]
    assert not violations, "\n".join(violations)


def test_what_a_feature_registers_needs_no_pipeline() -> None:
    """Only its commands do, which are imported when they are given."""
    violations = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in FILES
        if part_of(path) == "features" and "commands" not in path.with_suffix("").parts
        for name in sorted(read(path).imports)
        if name.split(".")[1:2] in (["pipeline"], ["preview"])
    ]
    assert not violations, "\n".join(violations)


def test_plugins_scaffolds_and_docs_import_the_interface_alone() -> None:
    foreign = re.compile(
        r"^\s*(?:from|import)\s+coursebuild(?:\.(?!api\b)\w+|\s)[^\n]*|import_module\(\W*coursebuild\."
        r"(?!api\b)[^\n]*",
        re.MULTILINE,
    )
    scaffolds = PACKAGE / "features/authoring/feature"
    paths = (
        *(ROOT / "plugins").rglob("*.py"),
        *(ROOT / "tests/fixtures/plugin").rglob("*.py"),
        *(ROOT / "tests/fixtures/scripts").glob("*_feature.txt"),
        *scaffolds.iterdir(),
        *(path for path in (ROOT / "docs").rglob("*.md") if "public" not in path.parts),
    )
    violations = [
        f"{path.relative_to(ROOT)}: {match[0].strip()}"
        for path in sorted(paths)
        for match in foreign.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not violations, "\n".join(violations)
    assert foreign.search("from coursebuild.core import model\n")
    assert foreign.search("from coursebuild import api\n")
    assert not foreign.search("from coursebuild.api import model\nimport coursebuild_tabs\n")


def test_mjcourse_and_mjbench_import_nothing_of_coursebuild() -> None:
    """Nor of each other; the tests of mjbench neither."""
    own_packages = {"mjcourse": {"coursebuild", "mjbench"}, "mjbench": {"coursebuild", "mjcourse"}}
    violations = [
        f"{path.relative_to(ROOT)} imports {name}"
        for folder, foreign in own_packages.items()
        for path in sorted((ROOT / folder).rglob("*.py"))
        for name in sorted(read(path).imports)
        if name.split(".")[0] in foreign | {"support"}
    ]
    assert not violations, "\n".join(violations)


def test_pure_parts_do_no_input_or_output() -> None:
    violations = [
        f"{path.relative_to(ROOT)} uses {name}"
        for path in FILES
        if part_of(path) in PURE
        for name in sorted((read(path).imports & IO_MODULES) | (read(path).calls & IO_CALLS))
    ]
    assert not violations, "\n".join(violations)


def test_files_stay_small_and_say_what_they_are_for() -> None:
    violations = [
        f"{path.relative_to(ROOT)} has {module.lines} lines and a docstring: {module.has_docstring}"
        for path, module in ((path, read(path)) for path in (*FILES, *BENCH_FILES))
        if module.lines > 450 or not module.has_docstring
    ]
    assert not violations, "\n".join(violations)


def test_no_pattern_has_a_possessive_group() -> None:
    """Python 3.11.0 to 3.11.4 match these wrongly (gh-106052), but not `(?>(?:…)*)`."""
    possessive_group = re.compile(r"\)([*+?]|\{[0-9,]+\})\+")
    violations = [
        f"{path.relative_to(ROOT)}: {node.value}"
        for path in FILES
        if possessive_group.search(text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
        if possessive_group.search(str(node.value))
    ]
    assert not violations, "\n".join(violations)


def test_what_is_imported_on_demand_is_there() -> None:
    pattern = re.compile(r'on_demand\(\s*"([\w.]+):(\w+)"')
    names = [name for path in FILES for name in pattern.findall(path.read_text(encoding="utf-8"))]
    assert names
    missing = [name for name in names if not hasattr(importlib.import_module(name[0]), name[1])]
    assert not missing


@pytest.mark.site
def test_asking_for_the_version_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from coursebuild.cli import main\n"
        "try: main(['--version'])\n"
        "except SystemExit: pass\n"
        "print(sorted(set(sys.modules) & {'numpy', 'mujoco', 'markdown_it', 'jinja2', 'pygments',"
        " 'msgspec', '_quickjs', 'py_mini_racer', 'fontTools', 'uharfbuzz', 'watchfiles'}))"
    )
    done = run_code(code)
    assert done.stdout.splitlines()[-1] == "[]"
