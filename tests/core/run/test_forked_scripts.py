"""A script in a forked process does what it does when Python runs it alone."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Mapping
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.runner import ScriptServer, clean_environment
from coursebuild.core.run.surroundings import OtherEnvironment, library_folder
from support.probe_scripts import FAILURES, PROBES
from support.runners import job

pytestmark = pytest.mark.site

ARGUMENTS = ("a b", "", "*", "é", "--flag=1", "\udc80")
Seen = tuple[str, str, int]


@functools.cache
def library() -> dict[str, str]:
    """What lets a bare Python import `mjcourse`, where it is not installed."""
    command = [sys.executable, "-P", "-c", "import mjcourse"]
    lacks = subprocess.run(command, capture_output=True, cwd="/").returncode
    return {"PYTHONPATH": library_folder()} if lacks else {}


def bare(root: Path, path: str) -> Seen:
    """What Python itself makes of a script."""
    # As short as the runner's own: the path of a socket in it must not have many characters.
    with tempfile.TemporaryDirectory(prefix="bare-", dir="/tmp") as temporary:
        done = subprocess.run(
            [sys.executable, path, *ARGUMENTS],
            cwd=root,
            env=clean_environment(os.environ) | {"TMPDIR": temporary} | library(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            start_new_session=True,
        )
    out, err = (
        data.decode("utf-8", "backslashreplace").replace("\r\n", "\n")
        for data in (done.stdout, done.stderr)
    )
    return plain(out), plain(err), done.returncode


def plain(text: str) -> str:
    """Without what differs between any two runs."""
    return re.sub(r"0x[0-9a-f]{6,}", "0x…", re.sub(r"\b\d{15}\b", "…", text))


def seen(run: ScriptRun) -> Seen:
    status = -run.status if run.outcome is Outcome.KILLED else run.status
    return plain(run.stdout), plain(run.stderr), status


def differences(server: ScriptServer, root: Path, scripts: Mapping[str, str]) -> list[str]:
    """The scripts that are not to a server what they are to Python, by name."""
    paths = [f"examples/script{number}.py" for number in range(len(scripts))]
    for path, code in zip(paths, scripts.values(), strict=True):
        encoding = "latin-1" if "latin-1" in code else "utf-8"
        (root / path).write_bytes(code.encode(encoding, "surrogatepass"))
    runs = server.run(root, [job(path, args=ARGUMENTS) for path in paths], parallel=2)
    found = []
    for name, path, run in zip(scripts, paths, runs, strict=True):
        alone = bare(root, path)
        found += [
            f"{name}: {ours!r}, but alone {theirs!r}"
            for ours, theirs in zip(seen(run), alone, strict=True)
            if ours != theirs
        ]
    return found


def dedented(names: list[str]) -> dict[str, str]:
    return {name: textwrap.dedent(PROBES[name]) for name in names}


@pytest.mark.parametrize("part", range(4))
def test_what_a_forked_script_finds_is_what_python_gives_it(
    forking: ScriptServer, root: Path, part: int
) -> None:
    assert differences(forking, root.resolve(), dedented([*PROBES][part::4])) == []


@pytest.mark.parametrize("kind", FAILURES)
def test_a_forked_script_fails_as_it_does_alone(
    forking: ScriptServer, root: Path, kind: str
) -> None:
    scripts = {f"{kind} {code!r}": code for code in FAILURES[kind]}
    assert differences(forking, root.resolve(), scripts) == []


def test_a_spawned_script_does_what_it_does_alone(spawning: ScriptServer, root: Path) -> None:
    scripts = dedented(["main", "modules of mujoco"]) | {"fails": FAILURES["errors"][0]}
    assert differences(spawning, root.resolve(), scripts) == []


# --- other installations


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> OtherEnvironment:
    """An interpreter with no packages."""
    prefix = tmp_path_factory.mktemp("place") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", prefix], check=True)
    return OtherEnvironment("a place", str(prefix / "bin/python"), str(prefix), library_folder())


def installed(place: OtherEnvironment, name: str) -> Path:
    """Where a module of a place is."""
    (folder,) = Path(place.prefix).glob("lib/python*/site-packages")
    return folder / f"{name}.py"


STARTS = (
    "import sys, json\nsys.marked = json.dumps(1)",
    "import no_such_module",
    "import sys\nsys.modules.pop('sitecustomize')",
    "1 / 0",
    "print('said', flush=True)",
    None,
)


def test_an_installation_with_its_own_start(place: OtherEnvironment, root: Path) -> None:
    (root / "examples/x.py").write_text(
        "import sys\nprint(getattr(sys, 'marked', None), 'sitecustomize' in sys.modules)"
    )
    module = installed(place, "sitecustomize")
    failed = []
    for code in STARTS:
        module.unlink(missing_ok=True)
        if code is not None:
            module.write_text(code)
        alone = subprocess.run(
            [place.python, "examples/x.py"],
            cwd=root,
            env=place.environment(clean_environment(os.environ)),
            capture_output=True,
            text=True,
        )
        for fork in (True, False):
            with ScriptServer(fork=fork, place=place) as server:
                (run,) = server.run(root, [job()], parallel=1)
            assert run.trace is not None
            given = (run.outcome, run.stdout, run.stderr, run.trace.modules)
            if given != (Outcome.OK, alone.stdout, alone.stderr, ()):
                failed.append(f"{code!r}, forked: {fork}: {given}")
    assert failed == []


UNFIT = (
    "import threading\nthreading.Thread(target=threading.Event().wait, daemon=True).start()",
    "print('hello')",
    "import os\nos.environ['X'] = '1'",
    "1 / 0",
    "import os\nos.abort()",
    "raise SystemExit",
    "import signal\nsignal.signal(15, signal.SIG_IGN)",
    "import os\nos.open('/dev/null', 0)",
)


def test_where_an_import_does_more_scripts_are_not_forked(
    place: OtherEnvironment, root: Path
) -> None:
    """A package that starts a thread, prints, fails or crashes when it is imported."""
    code = "if 0:\n    import numpy\n"
    code += "print('ran', 'coursebuild:' in open('/proc/self/cmdline').read())"
    (root / "examples/x.py").write_text(code)
    module = installed(place, "numpy")
    said = {}
    for body in ("pi = 3", *UNFIT):
        module.write_text(body)
        with ScriptServer(place=place) as server:
            (run,) = server.run(root, [job()], parallel=1)
        said[body] = run.stdout
    module.unlink()
    assert said == {"pi = 3": "ran True\n"} | dict.fromkeys(UNFIT, "ran False\n")


def test_a_package_that_is_not_installed_is_no_trouble(place: OtherEnvironment, root: Path) -> None:
    code = "try: import numpy\nexcept ModuleNotFoundError as error: print(error)\n"
    code += "print('coursebuild:' in open('/proc/self/cmdline').read())"
    (root / "examples/x.py").write_text(code)
    with ScriptServer(place=place) as server:
        (run,) = server.run(root, [job()], parallel=1)
    assert run.stdout == "No module named 'numpy'\nTrue\n"


def test_another_version_of_a_package_is_imported_anew(place: OtherEnvironment, root: Path) -> None:
    (root / "examples/x.py").write_text("import numpy\nprint(numpy.__version__)")
    module = installed(place, "numpy")
    with ScriptServer(place=place) as server:
        for version in ("1", "22"):
            module.write_text(f"__version__ = '{version}'")
            runs = [server.run(root, [job()], parallel=1)[0].stdout for _ in range(2)]
            assert runs == [f"{version}\n"] * 2
    module.unlink()
