"""Commands beside a preview, which does them: what is printed and written, signals, strangers."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import shlex
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.cli.handover import ask_preview, hand_over, receive, send, socket_place
from support.fixture_cases import fixture_text
from support.preview_process import Preview, serve_preview
from support.scratch_course import (
    FIRST,
    SECOND,
    WAIT_FOR_GO,
    CommandResult,
    Folder,
    Make,
    block,
    command,
    kill_at_end,
    wait_until_alone,
    without_seconds,
)
from support.waiting import wait_until

pytestmark = pytest.mark.site

SLOW = "## Slow\n\n" + block("slow.py", f"{WAIT_FOR_GO}print(3)", "3")


@pytest.fixture
def runtime() -> Iterator[str]:
    """A runtime folder of the user's, with a short path as they have."""
    folder = tempfile.mkdtemp(prefix="run")
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def slow(make: Make) -> Folder:
    return make(SLOW)


@contextlib.contextmanager
def preview_of(folder: Folder, runtime: str, *arguments: str) -> Iterator[Preview]:
    with serve_preview(folder, *arguments, env={"XDG_RUNTIME_DIR": runtime}) as preview:
        yield preview


def normalize(result: CommandResult, folder: Folder) -> tuple[int, str, str]:
    def plain(text: str) -> str:
        """Without times, waits for the preview's writes, and steps that the preview has done."""
        steps = "reading lessons and pages|drawing pages|another coursebuild .*; waiting for it"
        text = re.sub(rf"(?m)^({steps})\n", "", text)
        # A preview runs a drifted script once more when it is idle.
        text = re.sub(r"(; 1 script recorded)?, not yet repeated", "", text)
        text = re.sub(r'("seconds": |after )[\d.]+', r"\1#", without_seconds(text))
        return text.replace(str(folder.root), "ROOT")

    return result.status, plain(result.out), plain(result.err)


EDITS = {"DRIFT": ("2.5\n```", "2.4\n```"), "SLIP": ("```text\n2.4", "```tetx\n2.4")}


@pytest.mark.long
def test_commands_do_what_they_do_without_a_preview(make: Make, runtime: str) -> None:
    first = FIRST + block("drifted.py", "print(2.5)", "2.5")
    alone, served = (make(first, SECOND + "* a\n\n\n* b\n", name=n) for n in ("alone", "served"))
    for folder in (alone, served):  # what has run already is not run by whoever comes first
        for words in (("check",), ("export", "page"), ("build",)):
            assert folder.run(*words).status == 0
    env = {"XDG_RUNTIME_DIR": runtime}
    with preview_of(served, runtime) as preview:
        preview.wait_for_line("checked: ")
        lines = fixture_text("scripts/commands_beside_preview.txt").splitlines()
        for words in (shlex.split(line) for line in lines if not line.startswith("#")):
            if words[0] in EDITS:
                for folder in (alone, served):
                    folder.replace(folder.lesson(), *EDITS[words[0]])
                continue
            result = normalize(served.run(*words, env=env), served)
            assert result == normalize(alone.run(*words), alone), words
            line = " ".join(word for word in words if word not in ("-C", "content"))
            preview.wait_for_line(f"done: `coursebuild {line}`, exit status {result[0]} (")
    assert served.tree() == alone.tree()


def test_a_command_writes_to_its_own_terminal(make: Make, runtime: str) -> None:
    """In its colours and its width, from its folder, to its streams."""
    folder = make(FIRST.replace("```text\n1\n", "```text\n2\n"))
    folder.run("check")
    env = folder.environment({"XDG_RUNTIME_DIR": runtime, "TERM": "xterm"})

    def run_in_terminal() -> bytes:
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 50, 0, 0))
        words = command("check", "content/lessons/1.1-one.md")
        with subprocess.Popen(
            words, cwd=folder.root, env=env, stdout=theirs, stderr=subprocess.DEVNULL
        ) as process:
            os.close(theirs)
            output = b""
            with contextlib.suppress(OSError):  # how the end of a terminal is told
                while part := os.read(ours, 4096):
                    output += part
        os.close(ours)
        assert process.returncode == 1
        return output

    alone = run_in_terminal()
    with preview_of(folder, runtime) as preview:
        preview.wait_for_line("checked: ")
        assert run_in_terminal() == alone
        preview.wait_for_line("done: `coursebuild check content/lessons/1.1-one.md`")
        result = subprocess.run(
            f"{' '.join(command('check'))} >&-", shell=True, cwd=folder.root, env=env
        )
        assert result.returncode == 1
    assert b"\x1b[" in alone


def test_a_script_of_the_preview_holds_up_nobody_else(make: Make, runtime: str) -> None:
    folder = make(SLOW, SECOND)
    env = {"XDG_RUNTIME_DIR": runtime}
    with preview_of(folder, runtime) as preview:
        preview.wait_for_line("running examples/slow.py")
        for words in (("check", "1.2"), ("update", "1.2"), ("new", "lesson", "1.3", "Third")):
            result = folder.run(*words, env=env)
            # The second script may still be running in the preview, for a moment.
            is_held_up = "examples/slow.py" in result.err
            assert (result.status, is_held_up) == (0, False), (words, result)
        process = folder.start(
            "check", "1.1", env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        with kill_at_end(process):
            assert process.stderr is not None and process.stdout is not None
            for line in process.stderr:
                if b"another coursebuild is running examples/slow.py" in line:
                    break
            folder.write("go", "")
            assert b"ok       examples/slow.py  cached" in process.stdout.read()
            assert process.wait() == 0
        preview.wait_for_line("checked: everything holds")


def test_commands_at_once_are_all_done(make: Make, runtime: str) -> None:
    folder = make(FIRST, SECOND)
    with preview_of(folder, runtime) as preview, contextlib.ExitStack() as stack:
        processes = [
            stack.enter_context(kill_at_end(folder.start(*words, env={"XDG_RUNTIME_DIR": runtime})))
            for words in (("check",), ("update",), ("extract",), ("check", "1.2"), ("build",))
        ]
        assert [process.wait(300) for process in processes] == [0] * 5
        for word in ("check", "update", "extract", "check 1.2", "build"):
            preview.wait_for_line(f"done: `coursebuild {word}`, exit status 0 (")


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_command_and_not_the_preview(
    slow: Folder, runtime: str, number: int, status: int
) -> None:
    with preview_of(slow, runtime) as preview:
        with started_check(slow, runtime, preview) as process:
            process.send_signal(number)
            assert process.wait(300) == status
            assert process.stderr is not None
            last = process.stderr.read().splitlines()[-1]
            assert last == {130: b"interrupted", 143: b"terminated"}[status]
        preview.wait_for_line(f"done: `coursebuild check`, exit status {status} (")
        slow.write("go", "")
        preview.wait_for_line("checked: everything holds")


def test_a_command_ends_with_whoever_asked_for_it(slow: Folder, runtime: str) -> None:
    with preview_of(slow, runtime) as preview:
        with started_check(slow, runtime, preview) as process:
            process.kill()
        preview.wait_for_line("done: `coursebuild check`, exit status 143 (")


def test_a_command_whose_process_is_killed_says_so(slow: Folder, runtime: str) -> None:
    with preview_of(slow, runtime) as preview:
        with started_check(slow, runtime, preview) as process:
            (server,) = (p for p in children(preview.process.pid) if is_copy(p, preview))
            (supervisor,) = children(server)
            (job,) = children(supervisor)
            os.kill(supervisor, signal.SIGKILL)
            assert process.wait(300) == 1
            assert process.stderr is not None
            assert f"the preview's process {job}, which did this, has ended".encode() in (
                process.stderr.read()
            )
            wait_until(lambda: not Path(f"/proc/{job}/cwd").exists(), "the command's end")
        slow.write("go", "")
        assert slow.run("check", env={"XDG_RUNTIME_DIR": runtime}).status == 0


def test_a_command_goes_on_after_the_preview(slow: Folder, runtime: str) -> None:
    with preview_of(slow, runtime) as preview:
        with started_check(slow, runtime, preview) as process:
            (server,) = (p for p in children(preview.process.pid) if is_copy(p, preview))
            preview.process.kill()
            slow.write("go", "")
            assert process.wait(300) == 0
        preview.process.wait()
        wait_until(lambda: not Path(f"/proc/{server}/cwd").exists(), "the server's end")
        result = slow.run("check", "1.1", env={"XDG_RUNTIME_DIR": runtime})
        assert (result.status, "preview" in result.err) == (0, False)  # its socket means nothing
    wait_until_alone(slow)


@contextlib.contextmanager
def started_check(
    folder: Folder, runtime: str, preview: Preview
) -> Iterator[subprocess.Popen[bytes]]:
    """A check that waits for a script that the preview runs."""
    preview.wait_for_line("running examples/slow.py")
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    process = folder.start("check", env={"XDG_RUNTIME_DIR": runtime}, **streams)
    with kill_at_end(process):
        assert process.stderr is not None
        while b"waiting for its result" not in process.stderr.readline():
            assert process.poll() is None
        preview.wait_for_line("for another terminal: `coursebuild check`")
        yield process


def children(process: int) -> list[int]:
    path = Path(f"/proc/{process}/task/{process}/children")
    return [int(number) for number in path.read_text().split()]


def is_copy(process: int, preview: Preview) -> bool:
    lines = (
        Path(f"/proc/{number}/cmdline").read_bytes() for number in (process, preview.process.pid)
    )
    return len({*lines}) == 1


def test_another_python_environment_does_without_the_preview(make: Make, runtime: str) -> None:
    folder = make(FIRST)
    with preview_of(folder, runtime) as preview:
        preview.wait_for_line("checked: ")
        env = {"XDG_RUNTIME_DIR": runtime, "PYTHONHASHSEED": "1"}
        result = folder.run("check", "1.1", env=env)
        message = (
            "the preview of this course runs another version or Python environment; "
            "this command runs without it\n"
        )
        assert (result.status, result.err.count(message)) == (0, 1)
        assert folder.run("check", "-q", env=env).err == ""
    assert not [line for line in preview.lines if line.startswith("done: ")]


def test_a_second_preview_says_where_the_first_is(make: Make, runtime: str) -> None:
    folder = make(FIRST)
    env = {"XDG_RUNTIME_DIR": runtime}
    with preview_of(folder, runtime) as preview:
        place = f"http://127.0.0.1:{preview.port}/"
        for words in ((), ("--port", "0"), ("--port", str(preview.port))):
            second = folder.run("serve", *words, env=env)
            message = f"serving {place} already (process {preview.process.pid})\n"
            assert (second.status, second.err) == (0, message)
        for words in (("--embed", "vscode-webview:"), ("--host", "localhost")):
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            process = folder.start("serve", "--port", "0", *words, env=env, **pipes)
            with kill_at_end(process):
                assert Preview(folder, process).port != preview.port
        assert folder.run("check", "1.1", env=env).status == 0
        preview.wait_for_line("done: `coursebuild check 1.1`, exit status 0 (")


def test_the_server_refuses_what_is_no_command_for_it(
    make: Make, runtime: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make(FIRST)
    with monkeypatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", runtime)
        place = socket_place(str(folder.root)) or ""
    with preview_of(folder, runtime) as preview:
        preview.wait_for_line("checked: ")
        assert Path(place).lstat().st_mode & 0o777 == 0o600
        assert Path(place).parent.stat().st_mode & 0o777 == 0o700
        for request, refusal in (
            ({"ask": "command", "words": ["serve"]}, "does not know this command"),
            ({"ask": "command", "words": ["lsp"]}, "does not know this command"),
            ({"ask": "command", "words": []}, "does not know this command"),
            ({"ask": "else"}, "does not know this command"),
            ({"ask": "command", "words": ["check"], "root": "/"}, "belongs to another course"),
        ):
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(place)
                send(connection, request)
                assert receive(connection) == {"refusal": refusal}
        garbage_parts = (
            b"",
            b"\0",
            b"\0\0\0\2{]",
            b"\xff\xff\xff\xff{}",
            b"GET / HTTP/1.1\r\n\r\n",
        )
        for garbage in garbage_parts:
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(place)
                connection.sendall(garbage)
        assert folder.run("check", "1.1", env={"XDG_RUNTIME_DIR": runtime}).status == 0
        preview.wait_for_line("done: `coursebuild check 1.1`, exit status 0 (")


# --- what is no socket of a preview


@pytest.fixture
def place(runtime: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the socket of a course would be."""
    (tmp_path / "content").mkdir()
    (tmp_path / "content/course.toml").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
    monkeypatch.chdir(tmp_path)
    place = Path(socket_place(str(tmp_path)) or "")
    place.parent.mkdir(mode=0o700)
    return place


def test_a_socket_that_nobody_listens_at_is_passed_over(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(place))
    assert hand_over(None, ["check"]) is None
    assert ask_preview(".") is None


@pytest.mark.parametrize("kind", ["file", "folder", "link", "open folder", "linked folder"])
def test_what_others_may_have_put_there_is_passed_over(
    place: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = place.parent.with_name("elsewhere")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.settimeout(0.01)
        match kind:
            case "file":
                place.touch()
            case "folder":
                place.mkdir()
            case "link":
                listener.bind(str(elsewhere))
                place.symlink_to(elsewhere)
            case "open folder":
                listener.bind(str(place))
                place.parent.chmod(0o710)
            case "linked folder":
                place.parent.rename(elsewhere)
                place.parent.symlink_to(elsewhere)
                listener.bind(str(place))
        if kind not in ("file", "folder"):
            listener.listen()
        assert hand_over(None, ["check"]) is None
        with pytest.raises(OSError, match=r"timed out|[Ii]nvalid argument"):
            listener.accept()
    assert capsys.readouterr().err == ""


def test_a_runtime_folder_that_others_can_enter_is_not_used(place: Path) -> None:
    place.parent.parent.chmod(0o755)
    other_place = socket_place(".")
    assert other_place is None or not other_place.startswith(str(place.parent))


@pytest.mark.parametrize("answer", [b"", b"\0\0\0\2{]", b"\0\0\0\2[]", b"\0\0\1"])
def test_a_listener_that_does_not_answer_is_left(
    place: Path, answer: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(place))
        listener.listen()
        process = os.fork()
        if process == 0:
            connection, _ = listener.accept()
            connection.recv(1 << 20)
            connection.sendall(answer)
            os._exit(0)
        assert hand_over(None, ["check"]) is None
        os.waitpid(process, 0)
    message = "the preview of this course does not answer; this command runs without it\n"
    assert capfd.readouterr().err == message
