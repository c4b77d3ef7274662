"""Work in forked copies: answered in order, whatever the copies do, and none of them stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from coursebuild.effects.errors import EffectError
from coursebuild.effects.pool import Pool, can_fork

ROOT = Path(__file__).parents[2]
HERE = os.getpid()


def alive(process: int) -> bool:
    return Path(f"/proc/{process}").exists()


def where(request: object) -> tuple[object, int]:
    return request, os.getpid()


def test_answers_come_in_the_order_of_the_requests() -> None:
    def slow_at_first(number: int) -> int:
        time.sleep(0.05 if number < 2 else 0.0)
        return number * number

    with Pool(slow_at_first, 3) as pool:
        answers, copies = pool.run([(None, n) for n in range(40)])
    assert answers == [n * n for n in range(40)]
    assert set(copies) == {0, 1, 2}


def test_a_request_goes_to_the_copy_that_it_names_and_finds_what_that_remembers() -> None:
    seen: list[int] = []

    def remember(number: int) -> tuple[int, list[int]]:
        seen.append(number)
        return os.getpid(), list(seen)

    with Pool(remember, 2) as pool:
        first, copies = pool.run([(None, n) for n in range(8)])
        again, _ = pool.run([(copies[n], n) for n in range(8)])
    for n in range(8):
        assert first[n][0] == again[n][0]
        assert again[n][1].count(n) == 2
    assert seen == []


def test_each_copy_begins_before_its_first_request() -> None:
    begun: list[int] = []

    def seen(number: int) -> list[int]:
        return list(begun)

    with Pool(seen, 2, lambda: begun.append(os.getpid())) as pool:
        answers, _ = pool.run([(None, n) for n in range(6)])
    assert all(len(answer) == 1 and answer[0] != HERE for answer in answers)
    assert begun == []


def test_large_answers_and_requests() -> None:
    with Pool(lambda text: text * 3, 2) as pool:
        answers, _ = pool.run([(None, "x" * n * 100_000) for n in range(1, 20)])
    assert [len(answer) for answer in answers] == [n * 300_000 for n in range(1, 20)]


def test_what_a_copy_did_not_answer_is_answered_here() -> None:
    def dies(number: int) -> tuple[int, int]:
        if number % 5 == 3 and os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        return where(number)  # type: ignore[return-value]

    with Pool(dies, 2) as pool:
        answers, copies = pool.run([(n % 2, n) for n in range(20)])
    assert [answer[0] for answer in answers] == list(range(20))
    assert {answers[n][1] for n in range(20) if copies[n] is None} == {HERE}


def test_what_is_raised_in_a_copy_is_raised_here() -> None:
    def refuse(number: int) -> int:
        if number == 3:
            raise EffectError("no", help="never")
        return number

    with Pool(refuse, 2) as pool, pytest.raises(EffectError, match="no") as caught:
        pool.run([(None, n) for n in range(6)])
    assert caught.value.help == "never"
    assert "refuse" in "".join(caught.value.__notes__)


def test_what_cannot_be_sent_is_told_as_a_text() -> None:
    class HereError(Exception):
        pass

    def refuse(number: int) -> int:
        raise HereError("local")

    with Pool(refuse, 1) as pool, pytest.raises(RuntimeError, match="HereError: local"):
        pool.run([(None, 1)])


def test_no_copy_stays() -> None:
    with Pool(where, 3) as pool:
        answers, _ = pool.run([(None, n) for n in range(9)])
    processes = {process for _, process in answers}
    assert HERE not in processes
    assert not any(alive(process) for process in processes)


def test_without_copies_all_is_answered_here() -> None:
    with Pool(where, 0) as pool:
        assert pool.run([(None, 1), (0, 2)])[0] == [(1, HERE), (2, HERE)]
        assert pool.run([])[0] == []


def test_a_process_with_threads_is_not_copied() -> None:
    stop = threading.Event()
    thread = threading.Thread(target=stop.wait)
    thread.start()
    try:
        assert not can_fork()
    finally:
        stop.set()
        thread.join()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_copies_end_with_the_process(how: signal.Signals, tmp_path: Path) -> None:
    """Also where it cannot say so, and one that works ends when it is done."""
    script = tmp_path / "p.py"
    script.write_text(
        "import os, time\n"
        "from coursebuild.effects.pool import Pool\n"
        "def work(n):\n"
        "    os.write(1, b'%d\\n' % os.getpid())\n"
        "    time.sleep(1.0)\n"
        "with Pool(work, 2) as pool: pool.run([(None, n) for n in range(99)])\n"
    )
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:
        assert process.stdout is not None
        copies = [int(process.stdout.readline()) for _ in range(2)]
        process.send_signal(how)
        process.wait()
        until = time.monotonic() + 120
        while any(map(alive, copies)):
            assert time.monotonic() < until
            time.sleep(0.02)
