"""Work in forked processes: results come in order, and no worker stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.core.engine.page_pool import Workers, can_fork
from coursebuild.core.files.errors import EffectError
from support.run_code import program, run_code
from support.runners import wait_until_ended

pytestmark = pytest.mark.site

ROOT = Path(__file__).parents[3]
PARENT_PID = os.getpid()


def with_process(task: object) -> tuple[object, int]:
    return task, os.getpid()


def test_answers_come_in_the_order_of_the_tasks() -> None:
    def slow_at_first(number: int) -> int:
        time.sleep(0.05 if number < 2 else 0.0)
        return number * number

    with Workers(slow_at_first, 3) as workers:
        answers, by = zip(*workers.map([(None, n) for n in range(40)]), strict=True)
    assert list(answers) == [n * n for n in range(40)]
    assert set(by) == {0, 1, 2}


def test_a_task_goes_to_the_worker_that_it_names_and_finds_what_that_remembers() -> None:
    numbers: list[int] = []

    def remember(number: int) -> tuple[int, list[int]]:
        numbers.append(number)
        return os.getpid(), list(numbers)

    with Workers(remember, 2) as workers:
        first, by = zip(*workers.map([(None, n) for n in range(8)]), strict=True)
        again = [answer for answer, _ in workers.map([(by[n], n) for n in range(8)])]
    for n in range(8):
        assert first[n][0] == again[n][0]
        assert again[n][1].count(n) == 2
    assert numbers == []


def test_what_a_worker_did_not_answer_is_answered_here() -> None:
    def dies(number: int) -> tuple[object, int]:
        if (number >= 20 or number % 5 == 3) and os.getpid() != PARENT_PID:
            os.kill(os.getpid(), signal.SIGKILL)
        return with_process(number)

    def tasks() -> Iterator[tuple[int | None, int]]:
        for number in range(30):
            yield number % 3, number
            time.sleep(0.005)

    with Workers(dies, 3) as workers:
        answers, by = zip(*workers.map(tasks()), strict=True)
    assert [number for number, _ in answers] == list(range(30))
    assert {
        process for (_, process), worker in zip(answers, by, strict=True) if worker is None
    } == {PARENT_PID}
    assert by[25:] == (None,) * 5


def test_what_is_raised_in_a_worker_is_raised_here() -> None:
    class HereError(Exception):
        pass

    def refuse(number: int) -> int:
        if number == 3:
            raise EffectError("no", help="never")
        if number == 9:
            raise HereError("local")
        return number

    with Workers(refuse, 2) as workers, pytest.raises(EffectError, match="no") as caught:
        list(workers.map([(None, n) for n in range(6)]))
    assert caught.value.help == "never"
    assert "refuse" in "".join(caught.value.__notes__)
    with Workers(refuse, 1) as workers, pytest.raises(RuntimeError, match="HereError: local"):
        list(workers.map([(None, 9)]))  # it cannot be sent


def test_where_standard_input_is_closed() -> None:
    """A worker's pipe may then have the number of standard input."""
    shell = ["sh", "-c", 'exec "$0" -c "$1" <&-', sys.executable, program("are_workers")]
    process = subprocess.run(shell, capture_output=True, text=True, check=True)
    assert process.stdout == "True\n", process.stderr


def test_after_a_failure_no_answer_is_taken_for_another() -> None:
    def answer(task: str) -> tuple[str, int]:
        if task == "bad":
            raise EffectError("no answer")
        time.sleep(0.1)
        return task, os.getpid()

    with Workers(answer, 2) as workers:
        with pytest.raises(EffectError, match="no answer"):
            list(workers.map([(0, "slow"), (1, "bad")]))
        assert list(workers.map([(None, "later")])) == [(("later", PARENT_PID), None)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_at_the_moment_of_a_fork_is_for_the_process_that_forks(
    number: signal.Signals,
) -> None:
    """A terminal sends a signal to all of its processes; the worker gets it at once."""
    process = run_code(program("signal_at_fork"), int(number))
    # SIGTERM ends the worker, as it would a moment later: its task is done here.
    answered_here = number == signal.SIGTERM
    assert process.stdout == f"heard by True\n[(1, {answered_here})] set()\n"
    assert (process.stderr, process.returncode) == ("", 0)


def test_a_process_with_threads_is_not_copied() -> None:
    stop = threading.Event()
    thread = threading.Thread(target=stop.wait)
    thread.start()
    try:
        assert not can_fork()
    finally:
        stop.set()
        thread.join()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_workers_end_with_the_process(number: signal.Signals) -> None:
    """Even if the process is killed, and they are in the middle of a task."""
    with subprocess.Popen(
        [sys.executable, "-c", program("endless_work")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:
        assert process.stdout is not None
        workers = [int(process.stdout.readline()) for _ in range(2)]
        process.send_signal(number)
        process.wait()
        assert all(map(wait_until_ended, workers))
