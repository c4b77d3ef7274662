"""V8 in this process: its limits, its threads, its end."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from coursebuild.core.run import v8
from coursebuild.core.run.v8 import Isolate, LimitError, ScriptError, StoppedError
from support.fixture_cases import fixture_text
from support.run_code import program, run_code
from support.runners import processor_time
from support.waiting import wait_until

pytestmark = pytest.mark.engine

ROOT = Path(v8.__file__).parents[3]

SCRIPT = fixture_text("scripts/isolate.js")


@pytest.fixture
def isolate() -> Iterator[Isolate]:
    isolate = Isolate(SCRIPT)
    yield isolate
    isolate.close()


class TestIsolate:
    def test_texts_and_bytes_cross_the_border(self, isolate: Isolate) -> None:
        for text in ("", "é\u2028'\"\\\0\U0001d4b3", "x" * 5_000_000):
            assert isolate.call("same", text, 120.0) == text
        isolate.fill("x", b"\x00\x80\xff")
        assert isolate.call("read", "", 120.0) == "0,128,255"
        with pytest.raises(TypeError, match="number returned no string"):
            isolate.call("number", "", 120.0)

    def test_thrown_errors_are_reported(self, isolate: Isolate) -> None:
        with pytest.raises(ScriptError, match="Error: no such thing\n"):
            isolate.call("fail", "no such thing", 120.0)
        with pytest.raises(ScriptError, match="SyntaxError"):
            Isolate("(").close()

    def test_an_endless_script_is_ended_and_the_next_is_not(self, isolate: Isolate) -> None:
        for _ in range(3):
            with pytest.raises(LimitError, match=r"^ran for more than 0\.1 s$"):
                isolate.call("spin", "", 0.1)
            assert isolate.call("same", "next", 120.0) == "next"

    def test_a_late_result_is_never_taken_for_the_next(self, isolate: Isolate) -> None:
        """Nor does a script that is ended at its limit end the next one."""
        in_time = 0
        for n in range(300):
            text = str((0, 2_000, 100_000)[n % 3] + n)
            try:
                result = isolate.call("busy", text, (0.00002, 0.0002, 0.002, 120.0)[n % 4])
            except LimitError:
                continue
            assert result == text
            in_time += 1
        assert in_time >= 75

    def test_a_script_that_takes_all_memory_is_ended(self) -> None:
        small = Isolate(SCRIPT, memory=32 << 20)
        with pytest.raises(LimitError, match=r"^took more than 32 MiB$"):
            small.call("eat", "", 600.0)
        small.close()

    @pytest.mark.parametrize("end", ["stop", "close"])
    def test_another_thread_may_end_it_for_good(self, isolate: Isolate, end: str) -> None:
        threading.Timer(0.1, getattr(isolate, end)).start()
        with pytest.raises(StoppedError):
            for _ in range(1_000_000):
                isolate.call("same", "x", 600.0)
            isolate.call("spin", "", 600.0)
        with pytest.raises(StoppedError):
            isolate.call("same", "x", 600.0)

    def test_the_caller_may_run_an_event_loop(self, isolate: Isolate) -> None:
        async def work() -> str:
            return isolate.call("same", "here", 120.0)

        with ThreadPoolExecutor(1) as apart:  # in this thread there may be a loop of Playwright's
            assert apart.submit(asyncio.run, work()).result() == "here"


class TestLife:
    def test_an_interrupt_is_heard_and_ends_cleanly(self) -> None:
        process = subprocess.Popen(
            [sys.executable, "-W", "always", "-c", program("spin")],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        with process:
            assert process.stdout is not None and process.stderr is not None
            process.stdout.readline()
            before = processor_time(process.pid)
            wait_until(lambda: processor_time(process.pid) > before + 20, "the endless loop")
            os.kill(process.pid, signal.SIGINT)
            output, errors = process.communicate(timeout=120)
        assert (output, errors, process.returncode) == ("interrupted\n", "", 0)

    def test_a_process_that_forgets_to_close_ends(self) -> None:
        process = run_code(program("typeset_and_end"))
        assert (process.stdout, process.stderr, process.returncode) == ("1\n", "", 0)
