"""What a script looks at is known, in a forked process and in one of its own."""

from __future__ import annotations

import importlib
import mmap
import os
import py_compile
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from coursebuild.core.model.results import Trace
from coursebuild.core.run import tracing
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.run.tracing import Tracer
from support.fixture_cases import fixture_text
from support.runners import Run, both_ways, job, run_hanging

pytestmark = pytest.mark.site

RunTraced = Callable[[str], Trace]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path.resolve() / "a course"
    for folder in ("examples", "data", "lib"):
        (root / folder).mkdir(parents=True)
    (root / "data/a.txt").write_text("a")
    (root / "lib/helper.py").write_text("import other\nvalue = other.value\n")
    (root / "lib/other.py").write_text("value = 3\n")
    return root


@pytest.fixture
def traced(run: Run) -> RunTraced:
    def trace_one(code: str) -> Trace:
        trace = run(code).trace
        assert trace is not None
        return trace

    return trace_one


# --- files

SCRIPTS = tomllib.loads(fixture_text("scripts/traced.toml"))


def test_files_that_are_read_however_the_script_ends(traced: RunTraced) -> None:
    scripts = {**SCRIPTS["files"], "open('data/ü\\udcff')": ["data/ü\udcff"]}
    for code, files in scripts.items():
        trace = traced(code)
        assert [*trace.files] == files, code
        assert (trace.folders, trace.outside, trace.opaque) == ((), (), ""), code


def test_files_of_a_course_below_a_folder_that_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spawning: ScriptServer
) -> None:
    root = tmp_path.resolve() / ".cache/a course"
    (root / "examples").mkdir(parents=True)
    (root / "a.txt").write_text("a")
    (root.parent / "b.txt").write_text("b")
    (root / "examples/x.py").write_text("open('a.txt'); open('../b.txt')")
    monkeypatch.setenv("HOME", str(tmp_path.resolve()))
    (result,) = spawning.run(root, [job()], parallel=1)
    assert result.trace is not None
    assert ([*result.trace.files], result.trace.outside) == (["a.txt"], ())


def test_what_is_asked_about_files_without_opening_them(traced: RunTraced, root: Path) -> None:
    (root / "data/link").symlink_to("a.txt")
    for path in ("data/a.txt", "lib/helper.py", "lib/other.py"):
        (root / path).chmod(0o644)
        os.utime(root / path, ns=(9, 9))
    for code, answers in SCRIPTS["questions"].items():
        trace = traced(code)
        texts = [f"{path}: {answer}" for path, answer in (*trace.existence, *trace.statuses)]
        assert sorted(texts) == answers, code
    for code, paths in SCRIPTS["found"].items():
        assert [*traced(code).files] == paths, code
    for question in ("util.find_spec", "import_module"):
        code = f"import importlib.util\ntry: importlib.{question}('none')\nexcept ImportError: 0"
        trace = traced(code)
        assert any("none" in names for names in trace.sought), code
        assert trace.modules == ("none",), code


@both_ways
def test_functions_that_are_wrapped_behave_as_before(run: Run, root: Path) -> None:
    result = run(fixture_text("scripts/wrapped.txt"))
    assert result.stdout == "True True True True\nstat os\n", result.stderr
    lines = [line for line in result.stderr.splitlines() if set(line) - set(" ^~")]
    assert lines == [
        "Traceback (most recent call last):",
        f'  File "{root}/examples/x.py", line 11, in <module>',
        "    os.stat('data/none')",
        "FileNotFoundError: [Errno 2] No such file or directory: 'data/none'",
    ]


def test_files_that_are_read_before_a_timeout(server: ScriptServer, root: Path) -> None:
    code = "open('data/a.txt')\nprint('opened', flush=True)\nwhile True: pass"
    (result,) = run_hanging(server, root, code)
    assert result.trace is not None and result.trace.files == ("data/a.txt",)


def test_files_outside_and_links_into_the_project(
    traced: RunTraced, root: Path, tmp_path: Path
) -> None:
    (tmp_path / "out.txt").touch()
    (tmp_path / "link").symlink_to(root)
    for path in ("out.txt", "link/data/a.txt"):
        trace = traced(f"open({str(tmp_path / path)!r})\nimport json, numpy")
        inside = path != "out.txt"
        assert trace.outside == (() if inside else (str(tmp_path / path),))
        assert trace.files == (("data/a.txt",) if inside else ())
        assert "numpy" in trace.modules and trace.opaque == ""


@both_ways
def test_folders_that_are_listed(traced: RunTraced) -> None:
    trace = traced(SCRIPTS["scripts"]["listing"])
    assert trace.folders == (".", "data", "examples", "lib", "none")
    assert trace.opaque == ""


def test_files_that_forked_processes_read(traced: RunTraced) -> None:
    code = fixture_text("scripts/tried.txt")
    expected = {f"data/{i}{end}" for i in range(4) for end in ("", "-inner")}
    assert set(traced(code).files) == expected


def test_thousands_of_files_are_noted_up_to_a_limit(traced: RunTraced) -> None:
    code = "for i in range({}):\n    try: open(f'data/{{i}}-with-a-long-name')\n"
    code += "    except OSError: pass\n"
    trace = traced(code.format(5_000))
    assert (len(trace.files), trace.opaque) == (5_000, "")
    assert traced(code.format(40_000)).opaque == "it opens too many files to keep track of"


# --- imports


def test_modules_of_the_project_are_files(traced: RunTraced, root: Path) -> None:
    (root / "examples/pack").mkdir()
    for name in ("sibling", "random", "pack/__init__", "pack/inner"):
        (root / f"examples/{name}.py").write_text("value = 'mine'")
    trace = traced(SCRIPTS["scripts"]["imports"])
    files = {f"examples/{name}.py" for name in ("sibling", "random", "pack/inner")}
    files |= {f"examples/{name}/__init__.py" for name in ("sibling", "random", "pack/inner")}
    files |= {f"lib/{name}{end}" for name in ("helper", "other") for end in (".py", "/__init__.py")}
    assert set(trace.files) == {*files, "examples/pack/__init__.py"}
    assert (trace.folders, trace.modules) == ((), ())


def test_modules_are_compiled_from_their_sources(traced: RunTraced, root: Path) -> None:
    """What `__pycache__` holds may be another's, and fit all that Python compares."""
    (root / "examples/pack").mkdir()
    for name in ("sibling", "pack/__init__", "pack/inner"):
        source = root / f"examples/{name}.py"
        source.write_text("value = 'false'")
        unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
        py_compile.compile(str(source), invalidation_mode=unchecked)
        source.write_text("value = 'shown'")
    code = "import sibling, pack, pack.inner\n"
    trace = traced(f"{code}assert sibling.value + pack.value + pack.inner.value == 'shown' * 3")
    assert {f"examples/{name}.py" for name in ("sibling", "pack/inner")} <= {*trace.files}
    assert not any("__pycache__" in path for path in trace.files)


def test_what_could_hide_a_module_and_what_is_not_installed(traced: RunTraced) -> None:
    trace = traced(SCRIPTS["scripts"]["not installed"])
    (sought,) = trace.sought
    folder, _, names = sought.rstrip("}").partition("/{")
    assert (folder, trace.files) == ("examples", ())
    assert {"json", "numpy", "functools", "inspect", "no_such_module"} <= set(names.split(","))
    assert "sys" not in names.split(",")
    assert {"numpy", "no_such_module"} <= set(trace.modules) and "json" not in trace.modules


def noting(root: str, installed: Path) -> tuple[Tracer, bytearray]:
    """A tracer in this process, and what it notes."""
    records = bytearray()
    shared = cast("mmap.mmap", SimpleNamespace(write=records.extend))
    return Tracer(root, "/nowhere/t", [str(installed)], "/nowhere/o", shared), records


def test_an_environment_in_the_course_s_folder(tmp_path: Path) -> None:
    """Its packages count by their versions, as those of any other environment."""
    packages = tmp_path / ".venv/lib/python3.11/site-packages"
    (packages / "thing").mkdir(parents=True)
    (packages / "thing/__init__.py").write_text("")
    tracer, records = noting(str(tmp_path), packages)
    tracer.note_import("thing", [str(packages)])
    assert bytes(records) == b"mthing\0"


def test_a_package_writes_as_it_is_imported_where_the_tool_lies_in_the_course(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tracer, records = noting(str(Path(tracing.__file__).parents[3]), tmp_path)
    (tmp_path / "begins.py").write_text("import sys; sys.write_of_test('/home/me/folder')")
    monkeypatch.setattr(sys, "write_of_test", tracer.note_write, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("begins")
    assert not records
    tracer.note_write("/home/me/other")
    assert records


def test_forked_and_spawned_scripts_have_the_same_trace(
    root: Path, forking: ScriptServer, spawning: ScriptServer
) -> None:
    (root / "examples/x.py").write_text(SCRIPTS["scripts"]["both ways"])
    forked_trace, spawned_trace = (
        s.run(root, [job()], parallel=1)[0].trace for s in (forking, spawning)
    )
    assert forked_trace == spawned_trace


# --- traces that may be incomplete, and effects


def test_reasons_why_a_trace_is_opaque(traced: RunTraced) -> None:
    for code, reason in SCRIPTS["opaque"].items():
        assert traced(code).opaque == reason, code


def test_effects_are_noted_once_for_each_line(
    traced: RunTraced, root: Path, tmp_path: Path
) -> None:
    (root / "examples/sibling.py").write_text("\ndef write(): open('data/c', 'w')\n")
    outside = str(tmp_path / "o")
    trace = traced(SCRIPTS["scripts"]["effects"].replace("OUTSIDE", outside))
    assert (trace.opaque, trace.outside) == ("it writes files outside its temporary folder", ())
    assert sorted((effect.target, effect.path, effect.line) for effect in trace.effects) == [
        (outside, "examples/x.py", 2),
        ("127.0.0.1:0", "examples/x.py", 7),
        ("data/0", "examples/x.py", 3),
        ("data/c", "examples/sibling.py", 2),
        ("localhost", "examples/x.py", 4),
    ]


def test_files_that_a_script_wrote_are_no_dependency(traced: RunTraced) -> None:
    trace = traced("open('data/new', 'w').close()\nopen('data/new')\nopen('data/a.txt')")
    assert trace.files == ("data/a.txt",)
