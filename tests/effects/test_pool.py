"""Work in forked copies: answered in order, whatever the copies do, and none of them stays."""

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

from coursebuild.effects import pool as pool_module
from coursebuild.effects.errors import EffectError
from coursebuild.effects.pool import Pool, beside, can_fork

pytestmark = pytest.mark.site

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


@pytest.mark.parametrize("size", [0, 1, 4000, 65_500, 65_536, 131_072, 1 << 20])
def test_requests_of_about_the_size_of_a_pipe(size: int) -> None:
    texts = ["x" * max(0, size - n) for n in range(48)]
    with Pool(str.upper, 2) as pool:
        assert pool.run([(None, text) for text in texts])[0] == [text.upper() for text in texts]


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


def test_where_standard_input_is_closed() -> None:
    """A pipe of the copy may then have its number."""
    code = (
        "import os\n"
        "from coursebuild.effects.pool import Pool\n"
        "with Pool(lambda request: os.getpid(), 2) as pool:\n"
        "    print(os.getpid() not in pool.run([(None, 1), (None, 2)])[0])\n"
    )
    shell = ["sh", "-c", 'exec "$0" -c "$1" <&-', sys.executable, code]
    done = subprocess.run(shell, capture_output=True, text=True, check=True)
    assert done.stdout == "True\n", done.stderr


def test_without_copies_all_is_answered_here() -> None:
    with Pool(where, 0) as pool:
        assert pool.run([(None, 1), (0, 2)])[0] == [(1, HERE), (2, HERE)]
        assert pool.run([])[0] == []


def test_requests_are_made_while_copies_answer(tmp_path: Path) -> None:
    made = tmp_path / "made"

    def waits(number: int) -> int:
        while not made.exists():  # for ever, if the others were only made when this is answered
            time.sleep(0.001)
        return number

    def requests() -> Iterator[tuple[int | None, int]]:
        yield from ((None, number) for number in range(10))
        made.touch()
        yield None, 10

    with Pool(waits, 2) as pool:
        assert pool.run(requests())[0] == list(range(11))


def test_requests_that_come_late_go_to_the_copies_that_they_name() -> None:
    """Also to one that has had nothing to do for a while."""

    def requests() -> Iterator[tuple[int | None, int]]:
        for number in range(12):
            yield int(number >= 8), number
            time.sleep(0.01)

    with Pool(where, 2) as pool:
        answers, copies = pool.run(requests())
    assert [number for number, _ in answers] == list(range(12))
    assert copies == [0] * 8 + [1] * 4


def test_copies_that_die_while_requests_come() -> None:
    def dies(number: int) -> tuple[object, int]:
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        return where(number)

    def requests() -> Iterator[tuple[int | None, int]]:
        for number in range(30):
            yield number % 3, number
            time.sleep(0.005)

    with Pool(dies, 3) as pool:
        assert pool.run(requests()) == ([(n, HERE) for n in range(30)], [None] * 30)


def test_what_a_request_cannot_be_made_for_is_raised() -> None:
    def requests() -> Iterator[tuple[int | None, int]]:
        yield None, 1
        raise EffectError("no sheet")

    found: list[int] = []
    with pytest.raises(EffectError, match="no sheet"), Pool(where, 2) as pool:
        found += [copy.process for copy in pool._copies if copy is not None]
        pool.run(requests())
    assert len(found) == 2
    assert not any(alive(process) for process in found)


def test_after_a_failure_no_answer_is_taken_for_another() -> None:
    def answer(request: str) -> tuple[str, int]:
        if request == "bad":
            raise EffectError("no answer")
        time.sleep(0.1)
        return request, os.getpid()

    with Pool(answer, 2) as pool:
        with pytest.raises(EffectError, match="no answer"):
            pool.run([(0, "slow"), (1, "bad")])
        assert pool.run([(None, "later")])[0] == [("later", HERE)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_at_the_moment_of_a_fork_is_for_the_process_that_forks(
    number: signal.Signals, tmp_path: Path
) -> None:
    """As one that a terminal sends to all of its processes comes to both, in the copy at once."""
    code = (
        "import os, signal, sys\n"
        "from coursebuild.effects.pool import Pool\n"
        "number = int(sys.argv[1])\n"
        "def heard(*_): print('heard by', os.getpid() == here, flush=True)\n"
        "here = os.getpid()\n"
        "signal.signal(number, heard)\n"
        "os.register_at_fork(after_in_child=lambda: os.kill(os.getpid(), number),\n"
        "                    after_in_parent=lambda: os.kill(os.getpid(), number))\n"
        "with Pool(lambda request: (request, os.getpid() == here), 1) as pool:\n"
        "    print(pool.run([(None, 1)])[0], signal.pthread_sigmask(signal.SIG_BLOCK, []))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(int(number))], cwd=ROOT, capture_output=True, text=True
    )
    # SIGTERM ends the copy, as it would a moment later: what it was to answer is answered here.
    answered_here = number == signal.SIGTERM
    assert done.stdout == f"heard by True\n[(1, {answered_here})] set()\n"
    assert (done.stderr, done.returncode) == ("", 0)


@pytest.fixture
def forks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever other tests have imported into this process."""
    monkeypatch.setattr(pool_module, "can_fork", lambda: True)


@pytest.mark.usefixtures("forks")
def test_something_is_made_beside() -> None:
    with beside(os.getpid) as made:
        process = made()
    assert process != HERE
    assert not alive(process)


@pytest.mark.usefixtures("forks")
def test_what_is_made_beside_and_not_asked_for_goes(tmp_path: Path) -> None:
    begun = tmp_path / "begun"

    def make() -> None:
        begun.write_text(str(os.getpid()))
        time.sleep(600)

    with beside(make):
        while not begun.exists() or not begun.read_text():
            time.sleep(0.001)
    assert not alive(int(begun.read_text()))


@pytest.mark.usefixtures("forks")
def test_what_fails_beside_is_made_here() -> None:
    def dies() -> int:
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        return os.getpid()

    def refuses() -> int:
        raise EffectError("no")

    with beside(dies) as made:
        assert made() == HERE
    with beside(refuses) as refused, pytest.raises(EffectError, match="no"):
        refused()


def test_where_there_is_no_copy_nothing_is_made_before_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool_module, "can_fork", lambda: False)
    calls: list[int] = []
    with beside(lambda: calls.append(os.getpid())) as made:
        assert calls == []
        made()
    assert calls == [HERE]


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
