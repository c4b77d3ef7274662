"""Scratch courses: making them, running commands on them, looking at what became of them."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from coursebuild.cli import main
from coursebuild.core.engine.store import HASH, Store
from coursebuild.core.files.trust import make_store
from coursebuild.pipeline.options import Options
from support.waiting import wait_until

ROOT = Path(__file__).parents[2]
SLUGS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
HELLO = 'print("hello", 3.14159)\n'


def block(
    path: str, code: str, output: str | None = None, comparison: str = "", info: str = ""
) -> str:
    """A script of a lesson and, with an output, what it prints."""
    text = f"```python file=examples/{path}{info and ' '}{info}\n{code.rstrip()}\n```\n\n"
    if output is not None:
        text += f"Output:\n\n```text{comparison and ' '}{comparison}\n{output.rstrip()}\n```\n\n"
    return text


SILENT = {"PYTHONWARNINGS": "error,ignore::ResourceWarning"}
"""A signal can come when something has just been opened and nobody holds it yet, in Python's own
code as anywhere: it is closed when it is found to be unused, and a process that ends needs no more.
"""

GOOD = "## Hello\n\n" + block("hello.py", HELLO, "hello 3.14159")
"""A lesson in which everything holds."""


@dataclass(frozen=True, slots=True)
class CommandResult:
    """What a command did."""

    status: int
    out: str
    err: str

    def require_success(self) -> CommandResult:
        assert self.status == 0, self.out + self.err
        return self


@dataclass(frozen=True, slots=True)
class Folder:
    """A scratch course."""

    root: Path

    def fill(self, lessons: Sequence[str | bytes], stores: Path) -> None:
        self.write("content/course.toml", course_map(len(lessons)))
        for number, text in enumerate(lessons, 1):
            self.write(self.lesson(number), text)
        self.borrow(stores)

    def borrow(self, stores: Path) -> None:
        """Keep fonts and the like with other courses."""
        make_store(f"{self.root}/.coursebuild", str(self.root))
        for store in stores.iterdir():
            (self.root / ".coursebuild" / store.name).symlink_to(store)
        self.tmp.mkdir(exist_ok=True)

    def copy(self, course: Path) -> None:
        for name in ("content", "models", "docs", "lib", "runs", "matplotlibrc"):
            if (course / name).is_dir():
                shutil.copytree(course / name, self.root / name)
            elif (course / name).is_file():
                shutil.copy(course / name, self.root / name)

    def duplicate(self, root: Path) -> Folder:
        """The same course elsewhere, with all that is kept of it."""
        copy = Folder(Path(shutil.copytree(self.root, root, symlinks=True)))
        copy.tmp.mkdir()
        return copy

    @property
    def tmp(self) -> Path:
        """Where the tool and all it starts put temporary files; by it they are found."""
        return self.root.with_name(f"{self.root.name}.tmp")

    def lesson(self, number: int = 1) -> str:
        return f"content/lessons/1.{number}-{SLUGS[number - 1]}.md"

    def write(self, path: str, data: str | bytes) -> None:
        full = self.root / path
        full.parent.mkdir(parents=True, exist_ok=True)
        full.write_bytes(data.encode() if isinstance(data, str) else data)

    def read(self, path: str) -> bytes:
        return (self.root / path).read_bytes()

    def text(self, path: str) -> str:
        return self.read(path).decode()

    def replace(self, path: str, old: str, new: str) -> None:
        text = self.text(path)
        assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times in {path}"
        self.write(path, text.replace(old, new))

    def tree(self, top: str = ".") -> dict[str, bytes]:
        """All files below a folder, but for caches, by path from there."""
        base = self.root / top
        return {
            path.relative_to(base).as_posix(): path.read_bytes()
            for path in sorted(base.rglob("*"))
            if path.is_file() and ".coursebuild" not in path.relative_to(self.root).parts
        }

    def entries(self) -> list[str]:
        """The names in the course's folder and in `content/lessons` and `examples`."""
        return sorted(
            path.relative_to(self.root).as_posix()
            for top in (".", "content", "content/lessons", "examples")
            if (self.root / top).is_dir()
            for path in (self.root / top).iterdir()
        )

    def spoil(self) -> int:
        """Damage the end of every entry of the store; gives how many there are."""
        entries = [
            path
            for path in (self.root / ".coursebuild").glob("*/*")
            if path.is_file() and not path.parent.is_symlink() and HASH.fullmatch(path.name)
        ]
        for path in entries:
            path.write_bytes(path.read_bytes()[:-7] + b"garbage")
        return len(entries)

    # --- commands

    def options(self, jobs: int = 1) -> Options:
        root = self.root.resolve()
        return Options(root, jobs, Store(root))

    def main(self, *arguments: str, cwd: Path | None = None) -> CommandResult:
        out, err = io.StringIO(), io.StringIO()
        with (
            contextlib.chdir(cwd or self.root),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            try:
                status = main(arguments)
            except SystemExit as stop:  # argparse's way to say that it is over
                assert isinstance(stop.code, int)
                status = stop.code
        return CommandResult(status, out.getvalue(), err.getvalue())

    def run(
        self,
        *arguments: str,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
        seconds: float = 600.0,
    ) -> CommandResult:
        process = subprocess.run(
            command(*arguments),
            cwd=cwd or self.root,
            env=self.environment(env),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
        )
        return CommandResult(process.returncode, process.stdout.decode(), process.stderr.decode())

    def start(
        self, *arguments: str, env: Mapping[str, str] | None = None, code: str = "", **pipes: int
    ) -> subprocess.Popen[bytes]:
        """Begin a command, in a process group of its own; `code` takes the place of its start."""
        return subprocess.Popen(
            [sys.executable, "-c", code, *arguments] if code else command(*arguments),
            cwd=self.root,
            env=self.environment(env),
            stdin=subprocess.DEVNULL,
            preexec_fn=_as_from_a_shell,
            **pipes,
        )

    def environment(self, variables: Mapping[str, str] | None = None) -> dict[str, str]:
        """Of a command: nothing of how the tests were started decides what it shows."""
        unsaid = ("NO_COLOR", "FORCE_COLOR", "COLUMNS", "LINES", "TERM", "CI")
        outer = {name: value for name, value in os.environ.items() if name not in unsaid}
        ours = {"PYTHONPATH": str(ROOT), "TMPDIR": str(self.tmp), "PYTHONWARNINGS": "error"}
        ours["LOGNAME"] = str(
            self.tmp
        )  # of what is passed on to children, that which nothing reads
        return outer | ours | dict(variables or {})


Make = Callable[..., Folder]
"""Makes a course of lessons; see `maker`."""


def maker(parent: Path, stores: Path) -> Make:
    """Return what makes a course of lessons, in a folder whose name has unusual characters."""

    def make(*lessons: str | bytes, name: str = "a cöurse") -> Folder:
        folder = Folder(parent / name)
        folder.fill(lessons, stores)
        return folder

    return make


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "coursebuild", *arguments]


def without_locks(error: str = "ENOLCK") -> str:
    """What a process does first that is to find no locks in its file systems."""
    return (
        "import errno, fcntl, os\n"
        "def refuse(fd, operation):\n"
        f"    raise OSError(errno.{error}, os.strerror(errno.{error}))\n"
        "fcntl.flock = refuse\n"
    )


def _as_from_a_shell() -> None:
    os.setpgid(0, 0)
    for number in (signal.SIGINT, signal.SIGHUP):  # ignored where the tests run in the background
        signal.signal(number, signal.SIG_DFL)


def course_map(lessons: int) -> str:
    parts = ['[course]\ntitle = "Scratch"\n\n[[level]]\nid = "1"\ntitle = "Level"\n']
    for number, slug in enumerate(SLUGS[:lessons], 1):
        parts.append(
            f'[[level.lesson]]\nid = "1.{number}"\nslug = "{slug}"\ntitle = "Lesson {slug}"\n'
            'status = "complete"\n'
        )
    return "\n".join(parts)


def processes(folder: Folder) -> list[str]:
    """The command lines of live processes that work in a course or were started for it."""
    marks = (os.fsencode(folder.root), os.fsencode(folder.tmp))
    command_lines = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdecimal() or int(entry.name) == os.getpid():
            continue
        with contextlib.suppress(OSError):
            cwd = os.fsencode((entry / "cwd").readlink())
            environment = (entry / "environ").read_bytes()
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
            if state != "Z" and (cwd.startswith(marks) or any(m in environment for m in marks)):
                command_lines.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode())
    return command_lines


def wait_until_alone(folder: Folder) -> None:
    """Nothing of a course runs any more."""
    wait_until(lambda: not processes(folder), f"the end of all that runs in {folder.root}")


@contextlib.contextmanager
def kill_at_end(process: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def without_seconds(text: str) -> str:
    return re.sub(r"\d+\.\d\d s", "# s", text)


WAIT_FOR_GO = """import pathlib, posix, time
def is_there(name):
    try:
        return bool(posix.stat(name))
    except OSError:
        return False
while is_there("content") and not is_there("go"):
    time.sleep(0.01)
"""
"""The beginning of a script that goes on when there is a file `go`, which the tool does not see.

Away from its course, as readers run it, it waits for nothing.
"""
FIRST = "## One\n\n" + block("one.py", "print(1)", "1")
SECOND = "## Two\n\n" + block("two.py", "print(2)", "2")
DRIFTED_LESSON = "## One\n\n" + block("one.py", "print('value', 1.25)", "value 1.35", "digits")
