"""A child that answers lines can be interrupted, may print much, and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.child import JsonChild
from support.run_code import program
from support.runners import SOURCE_TREE, is_alive, wait_until_ended
from support.waiting import wait_until

pytestmark = pytest.mark.site


def make(tmp_path: Path, seconds: float = 120.0) -> JsonChild:
    script = tmp_path / "worker.py"
    script.write_text(program("answer"))
    return JsonChild(str(script), seconds)


def test_questions_and_answers(tmp_path: Path, temporary: Path) -> None:
    with make(tmp_path) as child:
        assert list(temporary.iterdir()) == [], "nothing before it is asked"
        noisy = {"do": "sys.stderr.write('x' * 1_000_000); sys.stderr.flush()"}
        questions = [None, [1.5, "ü\n\u2028"], {"a": True}, "x" * 3_000_000, noisy]
        replies = [child.ask(question) for question in questions]
        assert [reply["got"] for reply in replies] == questions
        pids = {reply["pid"] for reply in replies}
        assert len(pids) == 1
        assert Path(replies[0]["cwd"]).parent == temporary
    assert list(temporary.iterdir()) == []
    assert not is_alive(pids.pop())


def test_an_interrupt_from_another_thread(tmp_path: Path, temporary: Path) -> None:
    mark = tmp_path / "asked"

    def interrupt() -> None:
        wait_until(mark.exists, "the question")
        child.interrupt()

    with make(tmp_path) as child:
        child.ask(1)
        threading.Thread(target=interrupt, daemon=True).start()
        assert child.ask({"do": f"open({str(mark)!r}, 'w').close(); signal.pause()"}) is None
        assert child.death() == "crashed (SIGKILL)", "nobody waited until its time was over"
        with pytest.raises(EffectError, match="interrupted"):
            child.ask(2)
    assert list(temporary.iterdir()) == []


def test_half_an_answer_has_the_same_time_limit(tmp_path: Path) -> None:
    with make(tmp_path, 0.1) as child:
        assert (
            child.ask({"do": "sys.stdout.write('{'); sys.stdout.flush(); signal.pause()"}) is None
        )
        assert child.death() == "took longer than 0.1 s"
        assert child.ask(1)["got"] == 1, "another child"


@pytest.mark.parametrize("request_code", ["'wait'", "{'do': 'while True: pass'}"])
def test_it_ends_with_its_parent(tmp_path: Path, request_code: str) -> None:
    """However the parent ends, and whatever the child does at that moment."""
    make(tmp_path)
    env = {**os.environ, "TMPDIR": str(tmp_path)}
    words = [sys.executable, "-c", program("ask"), tmp_path / "worker.py", request_code]
    with subprocess.Popen(words, stdout=subprocess.PIPE, cwd=SOURCE_TREE, env=env) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        assert is_alive(pid)
        os.kill(parent.pid, signal.SIGKILL)
    assert wait_until_ended(pid)
