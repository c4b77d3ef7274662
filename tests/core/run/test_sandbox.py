"""Scripts in the sandbox try to get out of it.

Where a machine can have no sandbox, each of these tests looks at how it is refused, and says so.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.run.sandbox import find_sandbox
from support.runners import wait_until_ended
from support.sandboxes import require_sandbox

pytestmark = pytest.mark.site

Confine = Callable[..., list[ScriptRun]]
TRY = """
import os, sys
def attempt(what):
    try:
        print(what())
    except BaseException as error:
        print(type(error).__name__, error)
"""
"""Prints the result of an attempt, or its error."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "home"
    home.mkdir()
    (home / "secret").write_text("hush")
    monkeypatch.setenv("HOME", str(home))
    return home


@pytest.fixture
def confine(root: Path, home: Path) -> Confine:
    """Runs scripts in the sandbox, one after the other."""

    def confine(*codes: str, **options: object) -> list[ScriptRun]:
        jobs = []
        for number, code in enumerate(codes):
            (root / f"examples/x{number}.py").write_text(TRY + code)
            jobs.append(ScriptJob(f"examples/x{number}.py", (), 60.0, (), **options))
        with ScriptServer(sandbox=require_sandbox(root)) as server:
            return list(server.run(root, jobs, parallel=1))

    return confine


@pytest.fixture
def neighbour() -> Iterator[int]:
    """Another process of the same user, with a secret in its environment."""
    program = [sys.executable, "-c", "print(flush=True); import time; time.sleep(600)"]
    environment = {**os.environ, "SECRET": "hush"}
    with subprocess.Popen(program, env=environment, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline()
        yield process.pid
        process.kill()


DENIED_ERRORS = ("OSError [Errno", "FileNotFound", "Permission")
ATTEMPTS: dict[str, str | tuple[str, ...]] = {
    # the course
    "open('lesson.md', 'a')": "OSError [Errno ",
    "open('new', 'w')": "OSError [Errno ",
    "os.mkdir('folder')": "OSError [Errno ",
    "os.remove('lesson.md')": "OSError [Errno ",
    "os.rename('lesson.md', '/tmp/moved')": "OSError [Errno ",
    "os.chmod('lesson.md', 0o777)": "OSError [Errno ",
    "os.symlink('/etc/passwd', 'examples/y.py')": "OSError [Errno ",
    "libc.mount(b'', os.fsencode(os.getcwd()), b'', 4128, None)": "-1",
    "libc.umount2(os.fsencode(os.getcwd()), 2)": "-1",
    # the system
    "open('/proc/sys/kernel/core_pattern', 'w')": DENIED_ERRORS,
    "open('/proc/sysrq-trigger', 'w')": DENIED_ERRORS,
    "open('/usr/evil', 'w')": DENIED_ERRORS,
    "open(sys.executable, 'a')": DENIED_ERRORS,
    "open('/dev/evil', 'w')": DENIED_ERRORS,
    "open('/etc/shadow').read()": DENIED_ERRORS,
    "os.listdir('/run')": DENIED_ERRORS,
    "libc.unshare(0x10000000)": "-1",
    # the folder of the user, where what is written is gone afterwards
    "open(os.path.expanduser('~/secret')).read()": "FileNotFoundError",
    "os.makedirs(os.path.expanduser('~/.config'))": "None",
    "open(os.path.expanduser('~/.profile'), 'w').write('evil')": "4",
    # other processes
    "os.kill(OTHER, 9)": "ProcessLookupError",
    "libc.ptrace(16, OTHER, 0, 0)": "-1",
    "os.sched_setaffinity(OTHER, {0})": "ProcessLookupError",
    "os.kill(TESTS, 9)": "ProcessLookupError",
    "all(int(name) < 9 for name in os.listdir('/proc') if name.isdigit())": "True",
}
"""What a script tries, and how the result begins."""


def test_attempts_fail_and_change_nothing(
    confine: Confine, root: Path, home: Path, neighbour: int
) -> None:
    (root / "lesson.md").write_text("as it was")
    code = "import ctypes\nlibc = ctypes.CDLL(None)\n"
    code += f"OTHER, TESTS = {neighbour}, {os.getpid()}\n"
    (run,) = confine(code + "".join(f"attempt(lambda: {attempt})\n" for attempt in ATTEMPTS))
    for (attempt, expected), answer in zip(ATTEMPTS.items(), run.stdout.splitlines(), strict=True):
        assert answer.startswith(expected), attempt
    assert (root / "lesson.md").read_text() == "as it was"
    assert sorted(path.name for path in root.iterdir()) == ["examples", "lesson.md"]
    assert [path.name for path in home.iterdir()] == ["secret"]
    assert Path(f"/proc/{neighbour}").exists()


def test_the_network_by_address_and_by_name(confine: Confine) -> None:
    name = f"\0coursebuild-{os.getpid()}"
    with socket.create_server(("127.0.0.1", 0)) as tcp, socket.socket(socket.AF_UNIX) as abstract:
        abstract.bind(name)
        abstract.listen()
        port = tcp.getsockname()[1]
        (run,) = confine(
            "import socket\n"
            f"attempt(lambda: socket.create_connection(('127.0.0.1', {port}), 5))\n"
            "attempt(lambda: socket.create_connection(('192.0.2.1', 80), 5))\n"
            f"attempt(lambda: socket.create_connection(('localhost', {port}), 5))\n"
            "attempt(lambda: socket.getaddrinfo('example.org', 80))\n"
            f"attempt(lambda: socket.socket(socket.AF_UNIX).connect({name!r}))\n"
        )
        tcp.setblocking(False)
        with pytest.raises(BlockingIOError):
            tcp.accept()
    refused, unreachable, by_name, unknown, abstract_one = run.stdout.splitlines()
    assert refused.startswith("ConnectionRefusedError")
    assert unreachable.startswith("OSError")
    assert by_name.startswith(("ConnectionRefusedError", "gaierror", "OSError"))
    assert unknown.startswith("gaierror")
    assert abstract_one.startswith("ConnectionRefusedError")
    assert run.trace is not None
    addresses = ["127.0.0.1", "192.0.2.1", "localhost", "example.org"]
    assert [effect.target for effect in run.trace.effects] == addresses


@pytest.mark.usefixtures("neighbour")
def test_environments_and_files_of_other_processes(
    confine: Confine, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_TOKEN", "hush")
    with (home / "secret").open() as secret_file:
        os.set_inheritable(secret_file.fileno(), True)
        (run,) = confine(
            "import glob\n"
            "attempt(lambda: sorted(os.environ))\n"
            "for name in ('environ', 'cmdline'):\n"
            "    for path in glob.glob(f'/proc/[0-9]*/{name}'):\n"
            "        attempt(lambda: open(path).read())\n"
            "for path in glob.glob('/proc/[0-9]*/fd/*'):\n"
            "    attempt(lambda: os.readlink(path))\n"
        )
    assert not any(word in run.stdout for word in ("hush", "GITHUB_TOKEN", "secret"))
    assert "/dev/null" in run.stdout


def test_script_that_kills_all_it_can_ends_alone(confine: Confine, neighbour: int) -> None:
    first, second = confine("os.kill(os.getppid(), 15)\nos.kill(-1, 9)\n", "print('as before')")
    assert first.outcome is Outcome.KILLED
    assert (second.outcome, second.stdout) == (Outcome.OK, "as before\n")
    assert Path(f"/proc/{neighbour}").exists()


def test_forging_the_report_of_another_script(confine: Confine) -> None:
    forge = (
        "import glob\n"
        "parent = os.getppid()\n"
        "for path in glob.glob(f'/proc/{parent}/fd/*'):\n"
        "    try:\n"
        "        with open(path, 'wb', buffering=0) as pipe: pipe.write(%r)\n"
        "    except OSError: pass\n"
    )
    texts = (b"\xff" * 64, b"\0\0\0\2{}", b'\0\0\0\x0c{"parts":[]}' + b"x" * 9)
    *forged, last = confine(*(forge % text for text in texts), "print('mine')")
    assert all(run.outcome in (Outcome.KILLED, Outcome.OK) for run in forged)
    assert (last.outcome, last.stdout) == (Outcome.OK, "mine\n")


def test_a_process_that_stays(confine: Confine) -> None:
    mark = f"600.{os.getpid()}"
    (run,) = confine(
        "if not os.fork():\n"
        "    os.setsid()\n"
        "    if os.fork(): os._exit(0)\n"
        "    null = os.open('/dev/null', os.O_RDWR)\n"
        "    for fd in 0, 1, 2: os.dup2(null, fd)\n"
        f"    os.execv('/bin/sleep', ['sleep', '{mark}'])\n"
        "os.wait()\n"
    )
    assert run.outcome is Outcome.OK, run.stderr
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            is_sleeper = mark.encode() in path.read_bytes()
        except OSError:
            continue
        assert not is_sleeper or wait_until_ended(int(path.parent.name))


def test_filling_the_disk(confine: Confine, root: Path) -> None:
    (run,) = confine(
        "home = os.path.expanduser('~')\n"
        "for folder in os.environ['TMPDIR'], home, '/dev/shm', 'runs', '/':\n"
        "    os.makedirs(folder, exist_ok=True)\n"
        "    with open(folder + '/large', 'wb') as file:\n"
        "        attempt(lambda: os.posix_fallocate(file.fileno(), 0, 2 << 30))\n",
        writes=("runs",),
    )
    assert run.stdout.splitlines() == ["OSError [Errno 28] No space left on device"] * 5
    assert not list(root.glob("runs/*"))


def test_links_that_the_tool_would_follow(confine: Confine, root: Path, home: Path) -> None:
    secret = str(home / "secret")
    (root / "linked").symlink_to(home)
    (run,) = confine(
        "folder = os.environ['TMPDIR'] + '/figures-of-this-script'\n"
        f"os.symlink({secret!r}, folder + '/a.csv')\n"
        "os.mkfifo(folder + '/b.csv')\n"
        f"os.symlink({secret!r}, 'runs/c.csv')\n"
        "attempt(lambda: os.listdir('linked'))\n",
        figures=("a.csv", "b.csv"),
        writes=("runs", "linked"),
    )
    assert run.outcome is Outcome.OK, run.stderr
    assert run.figures == ()
    assert run.stdout.startswith("FileNotFoundError")
    assert not list(root.glob("runs/*"))
    assert [path.name for path in home.iterdir()] == ["secret"]


@pytest.mark.slow
def test_stopping_the_supervisor(confine: Confine) -> None:
    first, second = confine("os.kill(os.getppid(), 19)\n" * 3, "print('as before')")
    assert first.outcome is Outcome.KILLED
    assert second.stdout == "as before\n"


class TestResults:
    """Well-behaved scripts do the same as outside."""

    CODE = """
import numpy, mujoco, helper
from mjcourse import spatial
from pathlib import Path
with open("a.csv", "w") as file:
    file.write("1,2\\n")
model = mujoco.MjModel.from_xml_path("models/a.xml")
old = Path("runs/old.csv").read_text()
print(model.ngeom, helper.VALUE, old, os.getcwd(), os.path.expanduser("~"))
"""

    @pytest.fixture(autouse=True)
    def course(self, root: Path) -> None:
        for path, text in {
            "models/a.xml": "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>",
            "examples/helper.py": "VALUE = 3",
            "runs/old.csv": "old",
        }.items():
            (root / path).parent.mkdir(exist_ok=True)
            (root / path).write_text(text)

    def test_they_are_the_same(self, confine: Confine, root: Path) -> None:
        (inside,) = confine(self.CODE, figures=("a.csv",))
        job = ScriptJob("examples/x0.py", (), 60.0, (), figures=("a.csv",))
        with ScriptServer() as server:
            (outside,) = server.run(root, [job], parallel=1)
        assert outside.outcome is Outcome.OK, outside.stderr
        for name in ("outcome", "stdout", "stderr", "figures", "trace"):
            assert getattr(inside, name) == getattr(outside, name)

    def test_what_is_written_is_seen_and_goes(self, confine: Confine, root: Path) -> None:
        code = "open('runs/new', 'w').write(open('runs/old.csv').read())\nprint(os.listdir('runs'))"
        (run,) = confine(f"open('runs/old.csv', 'a').write('er')\n{code}", writes=("runs",))
        assert run.stdout == "['old.csv', 'new']\n" or run.stdout == "['new', 'old.csv']\n"
        assert run.trace is not None
        assert run.trace.opaque == "what it wrote went with its sandbox"
        assert [path.name for path in root.glob("runs/*")] == ["old.csv"]
        assert (root / "runs/old.csv").read_text() == "old"

    def test_trace_of_a_file_that_is_not_shown_is_opaque(
        self, confine: Confine, home: Path
    ) -> None:
        (run,) = confine("attempt(lambda: open(os.path.expanduser('~/secret')))")
        assert run.trace is not None
        assert run.trace.opaque == f"its sandbox does not show {home}/secret"


class TestRefusals:
    @pytest.fixture
    def programs(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        """The only folder on PATH."""
        folder = tmp_path / "programs"
        folder.mkdir()
        monkeypatch.setenv("PATH", str(folder))
        return folder

    def test_without_user_namespaces(self, programs: Path, root: Path) -> None:
        shell, message = (
            shutil.which("sh", path="/bin:/usr/bin"),
            "setting up uid map: not permitted",
        )
        (programs / "bwrap").write_text(f"#!{shell}\necho 'bwrap: {message}' >&2\nexit 1\n")
        (programs / "bwrap").chmod(0o755)
        with pytest.raises(EffectError) as refused:
            find_sandbox(root)
        assert refused.value.message == (
            f"`--sandbox` does not work here, Bubblewrap says: {message}"
        )
        assert "kernel.apparmor_restrict_unprivileged_userns" in refused.value.help
