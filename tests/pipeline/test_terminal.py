"""Terminals, pipes, signals and completion: the real command in a process of its own."""

from __future__ import annotations

import codecs
import contextlib
import fcntl
import json
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import (
    FIRST,
    GOOD,
    SECOND,
    SILENT,
    WAIT_FOR_GO,
    Folder,
    Make,
    block,
    command,
    kill_at_end,
    processes,
    wait_until_alone,
    without_seconds,
)
from support.waiting import wait_for_file

pytestmark = pytest.mark.site

ERASE = "\r\x1b[K"
SLOW = fixture_text("scripts/slow.txt")


# --- a terminal


class Terminal:
    """A pseudo-terminal with a command in it."""

    def __init__(self, folder: Folder, *arguments: str, columns: int = 80, **env: str) -> None:
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        self.process = subprocess.Popen(
            command(*arguments),
            cwd=folder.root,
            env=folder.environment({"TERM": "xterm-256color", **env}),
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            preexec_fn=_controlling,
        )
        os.close(slave)
        self.coloured_output = ""
        self._letters = codecs.getincrementaldecoder("utf-8")()

    def read(self, until: str | None = None, seconds: float = 300.0) -> str:
        """Read what is shown, up to a match of a pattern or to the end."""
        end = time.monotonic() + seconds
        while until is None or not re.search(until, self.coloured_output):
            left = end - time.monotonic()
            assert left > 0, f"{until!r} was not shown, but {self.coloured_output!r}"
            if not select.select([self.master], [], [], left)[0]:
                continue
            try:
                data = os.read(self.master, 1 << 16)
            except OSError:  # EIO: no process has the terminal open any more
                break
            self.coloured_output += self._letters.decode(data)
        return self.coloured_output

    def type(self, keys: bytes) -> None:
        os.write(self.master, keys)


def _controlling() -> None:
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextlib.contextmanager
def terminal(folder: Folder, *arguments: str, columns: int = 80, **env: str) -> Iterator[Terminal]:
    session = Terminal(folder, *arguments, columns=columns, **env)
    try:
        with kill_at_end(session.process):
            yield session
    finally:
        os.close(session.master)


def screen(output: str) -> str:
    """What stays on a terminal, without erased lines."""
    lines = []
    for line in output.replace("\r\n", "\n").split("\n"):
        lines.append(line.rpartition(ERASE)[2])
    return re.sub(r"\x1b\[[0-9;]*m", "", "\n".join(lines))


def test_a_terminal_shows_what_runs_and_then_only_the_results(make: Make) -> None:
    lesson = block("a.py", WAIT_FOR_GO + "print(1)", "1", info="timeout=600")
    folder = make("## One\n\n" + lesson + block("b.py", "print(2)", "2"))
    with terminal(folder, "check", "--jobs", "2") as window:
        window.read(r"running scripts 1/2  examples/a\.py [1-9]\d* s")
        folder.write("go", "")
        text = window.read()
        assert window.process.wait(120) == 0, text
    assert without_seconds(screen(text)) == (
        "ok       examples/a.py  # s\n"
        "ok       examples/b.py  # s\n"
        "\n"
        "1 lesson, 2 scripts run: everything holds\n"
    )
    assert "\x1b[32m" in text


def test_proposals_are_accepted_one_by_one(make: Make) -> None:
    """Each with its diff; what is declined stays, and `undo` takes all back."""
    text = (
        "See [a](term:fricion), [b](term:frictio) and [c](term:fricton).\n\nThe [friction]{term}.\n"
    )
    folder = make(text)
    with terminal(folder, "check", "--propose") as window:
        window.read(r"\[y/n/q\] ")
        window.type(b"n\n")
        window.read(r"(?s)\[y/n/q\] .*\[y/n/q\] ")
        window.type(b"maybe\ny\n")
        window.read(r"(?s)(\[y/n/q\] .*){4}")
        window.type(b"q\n")
        text_left = screen(window.read())
        assert window.process.wait(120) == 1
    assert "\n+See [a](term:friction), [b](term:frictio) and [c](term:fricton).\n" in text_left
    assert "\nfixed 1 mistake in 1 file (link-term); 2 left; " in text_left
    assert folder.text(folder.lesson()) == text.replace("frictio)", "friction)")
    assert folder.main("undo").status == 0
    assert folder.text(folder.lesson()) == text


def test_a_number_printed_at_two_places_has_a_proposal_for_each(make: Make) -> None:
    code = "print('before 1.25 J')\nprint('after 1.25 J')"
    text = block("energy.py", code, "before 1.25 J\nafter 1.25 J") + "\nIt stays `1.25`{out} J.\n"
    folder = make("## Energy\n\n" + text)
    with terminal(folder, "check", "--propose") as window:
        first = window.read(r"\[y/n/q\] ")
        window.type(b"n\n")
        window.read(r"(?s)\[y/n/q\] .*\[y/n/q\] ")
        window.type(b"y\n")
        window.read()
        assert window.process.wait(120) == 0
    assert '\n+It stays `1.25`{out="before"} J.\n' in screen(first)
    assert '`1.25`{out="after"} J' in folder.text(folder.lesson())


def test_the_live_line_fits_the_terminal(make: Make) -> None:
    names = [f"{'長い名前' * 4}_{n}.py" for n in range(3)]
    folder = make(
        "## One\n\n" + "".join(block(name, WAIT_FOR_GO, info="timeout=600") for name in names)
    )
    with terminal(folder, "check", "--jobs", "3", columns=44) as window:
        window.read("running scripts 0/3  examples/長い")
        folder.write("go", "")
        text = window.read()
        assert window.process.wait(120) == 0
    live = [part.partition("\r")[0] for part in text.split(ERASE) if part.startswith("running")]
    assert live
    assert max(sum(2 if ch > "⺀" else 1 for ch in line) for line in live) <= 43


def test_colours_are_for_a_terminal_that_wants_them(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")

    def coloured_output(**env: str) -> str:
        with terminal(folder, "check", **env) as window:
            text = window.read()
            assert window.process.wait(120) == 1
        assert "error[link-lesson]: " in re.sub(r"\x1b\[[0-9;]*m", "", text)
        return text

    dumb = coloured_output(TERM="dumb")
    assert "\x1b" not in dumb
    assert "  examples/hello.py\r\n" in dumb
    assert "\x1b[" in coloured_output(NO_COLOR="").replace(ERASE, "")
    assert "\x1b" not in coloured_output(NO_COLOR="1").replace(ERASE, "")
    for forced, none, coloured in (("1", "", True), ("", "", False), ("1", "1", False)):
        monkeypatch.setenv("FORCE_COLOR", forced)
        monkeypatch.setenv("NO_COLOR", none)
        assert ("\x1b[" in folder.main("check").out) == coloured, "into a pipe"


def test_quiet_on_a_terminal_shows_nothing(make: Make) -> None:
    with terminal(make(GOOD), "build", "--quiet") as window:
        assert window.read() == ""
        assert window.process.wait(120) == 0


def test_ctrl_c_in_a_terminal_interrupts(make: Make) -> None:
    folder = make("## One\n\n" + slow("slow.py"))
    with terminal(folder, "check") as window:
        window.read(r"examples/slow\.py [1-9]\d* s")
        window.type(b"\x03")
        text = window.read()
        assert window.process.wait(120) == 130
    assert screen(text).replace("^C", "").strip() == "interrupted"
    wait_until_alone(folder)


def test_ctrl_c_ends_a_preview_whatever_it_does(make: Make) -> None:
    """While a script and a lab run, by several Ctrl-C; while nothing runs, by one."""
    lab = {"title": "A lab", "model": "ball", "readouts": [{"label": "t", "expr": "data.time"}]}
    folder = make("## One\n\n" + slow("slow.py") + f"```lab\n{json.dumps(lab)}\n```\n")
    ball = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    folder.write("models/ball.xml", ball)
    with terminal(folder, "serve", "--port", "0", **SILENT) as window:
        window.read("running scripts 0/1")
        window.type(b"\x03\x03\x03\x03")
        text = window.read()
        assert window.process.wait(120) == 130
    assert screen(text).rstrip().endswith("interrupted")
    assert "Traceback" not in text
    wait_until_alone(folder)
    folder.replace("content/course.toml", "[course]\n", '[course]\npackages = ["lib"]\n')
    folder.write("lib/shared.py", "X = 1\n")
    folder.write(
        folder.lesson(), "## One\n\n" + block("a.py", "import shared\nprint(shared.X)", "1")
    )
    with terminal(folder, "serve", "--port", "0", "--host", "0.0.0.0") as window:
        window.read("everything holds")
        folder.write("lib/shared.py", "X = 2\n")
        window.read("output-drift")
        window.type(b"\x03")
        text = window.read()
        assert window.process.wait(120) == 130
    assert "▄" in text, "the link as a picture, for the camera of a phone"
    wait_until_alone(folder)


# --- pipes


def test_reader_that_has_seen_enough_makes_no_noise_and_the_verdict_stands(make: Make) -> None:
    mistakes = "".join(f"[gone](lesson:7.{n}) " for n in range(400))
    folder = make(GOOD + mistakes)
    for arguments in (["check", "--format", "json"], ["extract"]):
        read, write = os.pipe()
        os.close(read)  # nothing is ever read from it
        with kill_at_end(folder.start(*arguments, stdout=write, stderr=subprocess.PIPE)) as process:
            os.close(write)
            errors = process.communicate(timeout=120)[1].decode()
            assert process.returncode == 1, arguments
        assert "Traceback" not in errors and "BrokenPipe" not in errors


def test_full_disk_is_told(make: Make) -> None:
    folder = make(GOOD)
    for arguments in (["check"], ["check", "--help"], ["doctor"]):
        with Path("/dev/full").open("wb") as full:
            process = folder.start(*arguments, stdout=full.fileno(), stderr=subprocess.PIPE)
        with kill_at_end(process):
            errors = process.communicate(timeout=120)[1].decode()
            assert process.returncode == 1, arguments
        message = "coursebuild: standard output cannot be written: no space left on device\n"
        assert errors.endswith(message), arguments


def test_errors_for_which_there_is_no_place_change_no_status(make: Make) -> None:
    folder = make(GOOD)
    for arguments, status in ((["check"], 0), (["chec"], 2), (["undo"], 1)):
        with Path("/dev/full").open("wb") as full:
            process = folder.start(*arguments, stdout=subprocess.PIPE, stderr=full.fileno())
        with kill_at_end(process):
            process.communicate(timeout=120)
            assert process.returncode == status, arguments


def test_build_with_closed_streams_works(make: Make) -> None:
    folder = make(GOOD)
    line = ["bash", "-c", '"$@" >&- 2>&- <&-', "bash", *command("build")]
    result = subprocess.run(line, cwd=folder.root, env=folder.environment(), capture_output=True)
    assert (result.returncode, result.stdout, result.stderr) == (0, b"", b"")
    assert (folder.root / "public/index.html").is_file()


# --- signals


def slow(name: str) -> str:
    return block(name, SLOW, "1", info="timeout=600")


@pytest.mark.parametrize(
    ("command_", "number", "status"),
    [
        ("check", signal.SIGINT, 130),
        ("build", signal.SIGTERM, 143),
        ("update", signal.SIGKILL, -signal.SIGKILL),
    ],
)
def test_signal_ends_command_and_its_scripts(
    make: Make, command_: str, number: int, status: int
) -> None:
    folder = make("## One\n\n" + slow("slow.py") + slow("b.py"))
    before = folder.read(folder.lesson())
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = folder.start(command_, "--jobs", "2", env=SILENT, **pipes)
    with kill_at_end(process):
        wait_for_file(folder.root / "examples/slow.running")
        wait_for_file(folder.root / "examples/b.running")
        assert len(processes(folder)) >= 5
        os.killpg(process.pid, number)  # as a terminal does
        out, err = process.communicate(timeout=120)
        assert process.returncode == status
    wait_until_alone(folder)
    assert (out, b"Traceback" in err) == (b"", False)
    assert folder.read(folder.lesson()) == before
    assert not (folder.root / "public").exists()
    if number != signal.SIGKILL:
        assert err.decode().endswith("interrupted\n" if status == 130 else "terminated\n")
        assert list(folder.tmp.iterdir()) == []


def test_a_closed_terminal_ends_the_scripts(make: Make) -> None:
    folder = make("## One\n\n" + slow("slow.py"))
    process = folder.start("check", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with kill_at_end(process):
        wait_for_file(folder.root / "examples/slow.running")
        os.kill(process.pid, signal.SIGHUP)
        assert process.wait(120) == -signal.SIGHUP
    wait_until_alone(folder)


def test_ctrl_c_ends_waiting_for_another_run(make: Make) -> None:
    folder = make("## One\n\n" + slow("slow.py"))
    first = folder.start("check", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with kill_at_end(first):
        wait_for_file(folder.root / "examples/slow.running")
        second = folder.start("check", stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        with kill_at_end(second):
            assert second.stderr is not None
            line = second.stderr.readline().decode()
            assert f"another coursebuild (process {first.pid}) is at work" in line
            os.killpg(second.pid, signal.SIGINT)
            assert second.wait(120) == 130
        os.killpg(first.pid, signal.SIGINT)
        assert first.wait(120) == 130
    wait_until_alone(folder)


def test_the_folder_of_a_course_may_vanish(make: Make, tmp_path: Path) -> None:
    code = "import os, shutil\nshutil.rmtree(os.getcwd())"
    folder = make("## One\n\n" + block("x.py", code))
    folder.main("extract")
    result = folder.run("-C", str(folder.root), "check", cwd=tmp_path)
    assert "Traceback" not in result.err
    assert result.status in (0, 1)


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(FIRST, SECOND)
    folder.write("models/pendulum.xml", "<mujoco/>\n")
    return folder


def complete(folder: Folder, *line: str, cwd: Path | None = None) -> list[str]:
    result = folder.main("completion", "bash", "--", *line, cwd=cwd)
    assert (result.status, result.err) == (0, "")
    return result.out.split("\n")[:-1]


def test_words_are_completed_by_where_they_stand(course: Folder, tmp_path: Path) -> None:
    assert complete(course, "c") == ["check", "completion"]
    assert {"help", "check", "bench", "-C"} < {*complete(course, "")}
    assert complete(course, "help", "sta") == ["stability"]
    assert complete(course, "check", "--fo") == ["--format"]
    assert complete(course, "check", "--format", "j") == ["json", "junit"]
    assert complete(course, "check", "--out-of", "") == ["1.1", "1.2"]
    assert complete(course, "check", "--timings", "") == [], "the shell completes a file"
    assert complete(course, "update", "1.1", "1") == ["1.1", "1.2"]
    assert complete(course, "bench", "--quick", "") == ["pendulum"]
    assert complete(course, "explain", "output-d") == ["output-drift"]
    assert complete(course, "schema", "") == [
        "course",
        "exercise",
        "lab",
        "lab-ode",
        "lab-plot",
        "model",
        "quiz",
    ]
    assert "epub" in complete(course, "export", "")
    assert complete(course, "nosuch", "") == []
    elsewhere = ("-C", str(course.root), "check", "1")
    assert complete(course, *elsewhere, cwd=tmp_path) == ["1.1", "1.2"]
    for text in ("", "[", "level = 3", "[[level]]\nlesson = 2", "\x00"):
        course.write("content/course.toml", text)
        assert complete(course, "check", "") == [], text


def test_shells_take_what_is_printed(course: Folder, tmp_path: Path) -> None:
    bin = tmp_path / "bin"
    bin.mkdir()
    (bin / "coursebuild").write_text(f'#!/bin/sh\nexec {sys.executable} -m coursebuild "$@"\n')
    (bin / "coursebuild").chmod(0o755)
    bash = shutil.which("bash")
    assert bash is not None
    code = (
        f'PATH="{bin}:$PATH"; eval "$(coursebuild completion bash)"; complete -p coursebuild\n'
        'COMP_WORDS=(coursebuild check 1.2); COMP_CWORD=2; _coursebuild; echo "${COMPREPLY[@]}"\n'
        'COMP_WORDS=(coursebuild check --tru 1.2); _coursebuild; echo "${COMPREPLY[@]}"\n'
    )
    result = subprocess.run(
        [bash, "-c", code],
        cwd=course.root,
        env=course.environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout == "complete -o default -F _coursebuild coursebuild\n1.2\n--truth\n"
    for shell, line in (("zsh", "compdef _coursebuild coursebuild"), ("fish", "complete -c ")):
        assert line in course.main("completion", shell).out
