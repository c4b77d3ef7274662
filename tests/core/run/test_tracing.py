"""What a script looks at is known, in a forked process and in one of its own."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from coursebuild.core.model.results import Outcome, Trace
from coursebuild.core.run import tracing
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.run.tracing import Sink, Tracer
from support.runners import Run, both_ways, hangs, job

pytestmark = pytest.mark.site

Traced = Callable[..., Trace]


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
def traced(run: Run) -> Traced:
    def trace_one(code: str, outcome: Outcome = Outcome.OK) -> Trace:
        result = run(code)
        assert result.outcome is outcome, result.stderr
        assert result.trace is not None
        return result.trace

    return trace_one


class TestFiles:
    @pytest.mark.parametrize(
        ("code", "files"),
        [
            ("", []),
            ("open('data/a.txt').read()", ["data/a.txt"]),
            ("open(b'data/a.txt').read()", ["data/a.txt"]),
            ("import os\nopen(os.path.abspath('data/a.txt'))", ["data/a.txt"]),
            ("open('examples/.././data//a.txt')", ["data/a.txt"]),
            ("import os\nos.chdir('data')\nopen('a.txt')\nopen('../x')", ["data/a.txt", "x"]),
            ("import os\nos.chdir('data')\nopen('a.txt')\nos.chdir('..')\nopen('a.txt')", None),
            ("from pathlib import Path\nPath('data/a.txt').read_bytes()", ["data/a.txt"]),
            ("import os\nos.close(os.open('data/a.txt', os.O_RDONLY))", ["data/a.txt"]),
            ("import io\nio.open_code(__file__.replace('x.py', 'y.py'))", ["examples/y.py"]),
            ("import numpy as np\nnp.loadtxt('data/a.txt', dtype=str)", ["data/a.txt"]),
            ("import linecache\nlinecache.getline('data/a.txt', 1)", ["data/a.txt"]),
            ("open(__file__)", []),
            ("open('data/ü\\udcff')", ["data/ü\udcff"]),
            ("open('/dev/null'); open('/proc/self/stat')", []),
            ("import os\nf = os.environ['TMPDIR'] + '/f'\nopen(f, 'w').close()\nopen(f)", []),
            ("import tempfile\ntempfile.TemporaryFile().write(b'x')", []),
        ],
    )
    def test_read(self, traced: Traced, code: str, files: list[str] | None) -> None:
        safe = "import builtins\nreal = open\ndef tried(*a, **k):\n    try: return real(*a, **k)\n"
        safe += "    except OSError: pass\nopen = tried\nimport io\nio.open_code = (lambda f: "
        safe += "lambda p: tried(p))(io.open_code)\n" if "open_code" in code else "io.open_code)\n"
        trace = traced(safe + code)
        assert list(trace.files) == (["a.txt", "data/a.txt"] if files is None else files)
        assert (trace.folders, trace.outside, trace.opaque) == ((), (), "")

    def test_what_was_not_there(self, traced: Traced) -> None:
        trace = traced("open('data/none.txt')", Outcome.FAILED)
        assert list(trace.files) == ["data/none.txt"]

    def test_outside(self, traced: Traced, tmp_path: Path) -> None:
        (tmp_path / "out.txt").touch()
        trace = traced(f"open({str(tmp_path / 'out.txt')!r})\nimport json, numpy")
        assert trace.outside == (str(tmp_path / "out.txt"),)
        assert (list(trace.files), trace.modules, trace.opaque) == ([], ("numpy",), "") or set(
            trace.modules
        ) >= {"numpy"}

    def test_a_link_into_the_project(self, traced: Traced, root: Path, tmp_path: Path) -> None:
        (tmp_path / "link").symlink_to(root)
        trace = traced(f"open({str(tmp_path / 'link/data/a.txt')!r})")
        assert (list(trace.files), trace.outside) == (["data/a.txt"], ())

    @both_ways
    def test_folders(self, traced: Traced) -> None:
        trace = traced(
            "import os, glob, pathlib\nos.listdir('data')\nos.listdir()\nglob.glob('lib/*')\n"
            "list(pathlib.Path('examples').iterdir())\nlist(os.scandir('data'))\n"
            "try: os.listdir('none')\nexcept OSError: pass\n"
        )
        assert trace.folders == (".", "data", "examples", "lib", "none")
        assert trace.opaque == ""

    @pytest.mark.parametrize("end", ["os._exit(0)", "os.abort()", "os.kill(os.getpid(), 9)"])
    def test_it_is_known_however_the_script_ends(self, run: Run, end: str) -> None:
        result = run(f"import os\nopen('data/a.txt')\n{end}\n")
        assert result.trace is not None and list(result.trace.files) == ["data/a.txt"]

    def test_time_limit(self, run: Run) -> None:
        result = hangs(run, "open('data/a.txt')\nprint('opened', flush=True)\nwhile True: pass")
        assert result.trace is not None and list(result.trace.files) == ["data/a.txt"]

    def test_processes_that_it_forks(self, traced: Traced) -> None:
        code = "import os\nfor i in range(4):\n    if os.fork() == 0:\n"
        code += "        open(f'data/{i}', 'a+') if 0 else os.path.exists('x')\n"
        code += "        try: open(f'data/{i}')\n        except OSError: pass\n"
        code += "        if os.fork(): os.wait()\n        else:\n"
        code += (
            "            try: open(f'data/{i}-inner')\n            except OSError: os._exit(0)\n"
        )
        code += "        os._exit(0)\nfor i in range(4): os.wait()\n"
        expected = sorted(f"data/{i}{end}" for i in range(4) for end in ("", "-inner"))
        assert list(traced(code).files) == expected

    def test_thousands_are_known_and_what_is_too_much_is_said(self, traced: Traced) -> None:
        code = "for i in range({}):\n    try: open(f'data/{{i}}-with-a-long-name')\n"
        code += "    except OSError: pass\n"
        trace = traced(code.format(5_000))
        assert (len(list(trace.files)), trace.opaque) == (5_000, "")
        assert traced(code.format(40_000)).opaque == "it opens too many files to keep track of"


class TestImports:
    def test_a_sibling(self, traced: Traced, root: Path) -> None:
        (root / "examples/sibling.py").write_text("value = 1")
        (root / "examples/pack").mkdir()
        (root / "examples/pack/__init__.py").touch()
        (root / "examples/pack/inner.py").touch()
        trace = traced("import sibling\nfrom pack import inner")
        assert list(trace.files) == [
            "examples/pack/__init__.py",
            "examples/pack/inner.py",
            "examples/pack/inner/__init__.py",
            "examples/sibling.py",
            "examples/sibling/__init__.py",
        ]
        assert (trace.folders, trace.modules) == ((), ())

    def test_a_cached_module_counts_as_its_source(self, traced: Traced, root: Path) -> None:
        (root / "examples/sibling.py").write_text("value = 1")
        code = "import py_compile\npy_compile.compile(__file__.replace('x.py', 'sibling.py'))"
        assert "it writes files of the project" in traced(code).opaque
        assert list(root.glob("examples/__pycache__/*.pyc"))
        trace = traced("import sibling")
        assert list(trace.files) == ["examples/sibling.py", "examples/sibling/__init__.py"]

    def test_a_path_that_it_adds(self, traced: Traced) -> None:
        trace = traced("import sys\nsys.path.insert(0, 'lib')\nimport helper")
        assert {"lib/helper.py", "lib/other.py", "lib/other/__init__.py"} <= set(trace.files)
        assert trace.modules == ()

    def test_what_could_hide_a_module(self, traced: Traced) -> None:
        trace = traced("import json\nimport numpy.linalg\nimport sys")
        (sought,) = trace.sought
        folder, _, names = sought.rstrip("}").partition("/{")
        assert (folder, trace.files) == ("examples", ())
        assert {"json", "numpy", "functools", "inspect"} <= set(names.split(","))
        assert "sys" not in names.split(",")
        assert "numpy" in trace.modules and "json" not in trace.modules

    def test_an_environment_in_the_course_s_folder(self, tmp_path: Path) -> None:
        """Its packages count by their versions, as those of any other environment."""
        packages = tmp_path / ".venv/lib/python3.11/site-packages"
        (packages / "thing").mkdir(parents=True)
        (packages / "thing/__init__.py").write_text("")
        records = bytearray()
        sink = cast("Sink", SimpleNamespace(write=records.extend))
        tracer = Tracer(str(tmp_path), "/nowhere/t", [str(packages)], "/nowhere/o", sink)
        tracer.imported("thing", [str(packages)])
        assert bytes(records) == b"mthing\0"

    def test_a_package_writes_as_it_is_imported_where_the_tool_lies_in_the_course(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        records = bytearray()
        sink = cast("Sink", SimpleNamespace(write=records.extend))
        root = str(Path(tracing.__file__).parents[3])
        tracer = Tracer(root, "/nowhere/t", [str(tmp_path)], "/nowhere/o", sink)
        (tmp_path / "begins.py").write_text("import sys; sys.write_of_test('/home/me/folder')")
        monkeypatch.setattr(sys, "write_of_test", tracer.write, raising=False)
        monkeypatch.syspath_prepend(tmp_path)
        importlib.import_module("begins")
        assert not records
        tracer.write("/home/me/other")
        assert records

    def test_what_is_not_installed(self, traced: Traced) -> None:
        trace = traced("try: import no_such_module\nexcept ImportError: pass")
        assert trace.modules == ("no_such_module",)
        assert list(trace.files) == []

    def test_a_shadowed_module_is_the_project_s(self, traced: Traced, root: Path) -> None:
        (root / "examples/random.py").write_text("value = 'mine'")
        trace = traced("import random\nassert random.value == 'mine'")
        assert "examples/random.py" in trace.files

    def test_forked_and_spawned_agree(
        self, root: Path, forking: ScriptServer, spawning: ScriptServer
    ) -> None:
        (root / "examples/x.py").write_text(
            "import json, numpy, mujoco\nimport numpy.testing, logging\nopen('data/a.txt')\n"
            "numpy.random.rand()\n"
        )
        traces = [server.run(root, [job()], parallel=1)[0].trace for server in (forking, spawning)]
        assert traces[0] == traces[1]


class TestOpaque:
    @pytest.mark.parametrize(
        ("code", "why"),
        [
            ("open('data/new', 'w')", "it writes files of the project"),
            ("open('data/a.txt', 'a')", "it writes files of the project"),
            ("open('data/a.txt', 'r+')", "it writes files of the project"),
            ("import os\nos.mkdir('data/new')", "it writes files of the project"),
            ("import os\nos.rename('data/a.txt', 'data/b')", "it writes files of the project"),
            ("import os\nos.remove('data/a.txt')", "it writes files of the project"),
            ("from pathlib import Path\nPath('n').touch()", "it writes files of the project"),
            ("import os\nos.symlink('a', 'data/l')", "it writes files of the project"),
            ("import numpy as np\nnp.save('n.npy', [1])", "it writes files of the project"),
            ("import shutil\nshutil.copy('data/a.txt', 'n')", "it writes files of the project"),
            ("import subprocess\nsubprocess.run(['true'])", "it starts other programs"),
            ("import os\nos.system('true')", "it starts other programs"),
            ("import os\nos.popen('true').read()", "it starts other programs"),
            ("import os\nos.execv('/bin/true', ['true'])", "it starts other programs"),
            ("import os\nif not os.fork(): os.execv('/bin/true', ['true'])\nos.wait()", None),
            ("import os\nos.wait4(os.posix_spawn('/bin/true', ['true'], {}), 0)", None),
            ("import socket\nsocket.create_connection(('127.0.0.1', 1))", "it uses the network"),
            ("import socket\nsocket.socket().bind(('127.0.0.1', 0))", "it uses the network"),
            ("import socket\nsocket.getaddrinfo('localhost', 1)", "it uses the network"),
            ("import sqlite3\nsqlite3.connect('data/db')", "it opens a database"),
            ("import ctypes\nctypes.CDLL('./data/lib.so')", "it loads native code of the project"),
            ("import os\nos.listdir('/usr')", "it lists folders outside the project"),
        ],
    )
    def test_reasons(self, run: Run, code: str, why: str | None) -> None:
        result = run(code)
        assert result.trace is not None
        assert result.trace.opaque == (why or "it starts other programs")

    def test_writing_outside(self, traced: Traced, tmp_path: Path) -> None:
        trace = traced(f"open({str(tmp_path / 'o')!r}, 'w')")
        assert trace.opaque == "it writes files outside its temporary folder"
        assert trace.outside == ()
        place = f"{tmp_path / 'o'}", "examples/x.py", 1
        assert [(each.what, each.path, each.line) for each in trace.effects] == [place]

    def test_effects_are_told_once_for_each_line(self, traced: Traced, root: Path) -> None:
        (root / "examples/sibling.py").write_text("\ndef write(): open('data/c', 'w')\n")
        trace = traced(
            "import os, sibling, socket\n"
            "for n in range(9): os.mkdir(f'data/{n}')\n"
            "socket.getaddrinfo('localhost', 1)\n"
            "if not os.fork(): sibling.write(); os._exit(0)\n"
            "os.wait()\n"
            "socket.socket().bind(('127.0.0.1', 0))\n"
        )
        assert sorted((each.what, each.path, each.line) for each in trace.effects) == [
            ("127.0.0.1:0", "examples/x.py", 6),
            ("data/0", "examples/x.py", 2),
            ("data/c", "examples/sibling.py", 2),
            ("localhost", "examples/x.py", 3),
        ]

    @pytest.mark.parametrize(
        "code",
        [
            "import numpy, mujoco, logging, ctypes\nctypes.CDLL(None)",
            "import asyncio\nasyncio.run(asyncio.sleep(0))",
            "import sqlite3\nsqlite3.connect(':memory:')",
            "import os\nif not os.fork(): os._exit(0)\nos.wait()",
            "import tempfile\nwith tempfile.TemporaryDirectory() as d: open(d + '/x', 'w')",
            "import multiprocessing as m\nif __name__ == '__main__':\n"
            "    with m.get_context('fork').Pool(2) as p: p.map(abs, [1])",
            "import concurrent.futures as c\nwith c.ThreadPoolExecutor() as p: p.submit(abs, 1)",
        ],
    )
    def test_none(self, traced: Traced, code: str) -> None:
        assert traced(code).opaque == ""

    def test_programs_that_multiprocessing_starts(self, traced: Traced) -> None:
        code = "import multiprocessing as m\nif __name__ == '__main__':\n"
        code += "    p = m.get_context('spawn').Process(target=abs, args=(1,))\n"
        code += "    p.start()\n    p.join()\n"
        assert traced(code).opaque == "it starts other programs"

    def test_what_it_wrote_itself_is_no_dependency(self, traced: Traced) -> None:
        trace = traced("open('data/new', 'w').close()\nopen('data/new')\nopen('data/a.txt')")
        assert list(trace.files) == ["data/a.txt"]
