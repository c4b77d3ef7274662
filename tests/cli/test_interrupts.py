"""Ctrl-C and SIGTERM are heard wherever they come."""

from __future__ import annotations

import importlib
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from coursebuild.cli import interrupts
from coursebuild.cli.interrupts import Terminated, heeded

ROOT = Path(interrupts.__file__).parents[2]
EXCEPTIONS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}
pytestmark = pytest.mark.site
numbers = pytest.mark.parametrize("number", EXCEPTIONS)


def heard(number: signal.Signals, act: Callable[[], object]) -> None:
    """That a signal which comes while something is done is heard, at last."""
    with pytest.raises(EXCEPTIONS[number]) as raised, heeded():
        act()
        time.sleep(120)  # it ends as soon as the signal comes again
    assert raised.type is EXCEPTIONS[number]


@numbers
def test_anywhere(number: signal.Signals) -> None:
    heard(number, lambda: signal.raise_signal(number))


@numbers
def test_when_an_object_goes(number: signal.Signals) -> None:
    class Goes:
        def __del__(self) -> None:
            signal.raise_signal(number)

    heard(number, Goes)


@numbers
def test_when_nobody_refers_to_an_object_any_more(number: signal.Signals) -> None:
    class Referred:
        pass

    def refer() -> None:
        one = Referred()
        one.reference = weakref.ref(one, lambda _: None)  # type: ignore[attr-defined]
        references.append(weakref.ref(one, lambda _: signal.raise_signal(number)))

    references: list[weakref.ref[Referred]] = []
    heard(number, refer)


@numbers
def test_when_a_process_was_forked(number: signal.Signals) -> None:
    code = (
        "import os, signal, sys, time\n"
        "from coursebuild.cli.interrupts import heeded\n"
        "number = int(sys.argv[1])\n"
        "os.register_at_fork(after_in_parent=lambda: signal.raise_signal(number))\n"
        "try:\n"
        "    with heeded():\n"
        "        if os.fork() == 0: os._exit(0)\n"
        "        time.sleep(60)\n"
        "except KeyboardInterrupt as error: print(type(error).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(int(number))], capture_output=True, text=True, cwd=ROOT
    )
    assert (done.stdout, done.stderr) == (f"{EXCEPTIONS[number].__name__}\n", "")


@numbers
def test_while_a_type_is_looked_at(number: signal.Signals) -> None:
    """Where msgspec's C code calls Python, what is raised would end the process."""
    asked: list[int] = []

    def field() -> type:
        if not asked:
            asked.append(1)
            signal.raise_signal(number)
        return int

    inner = msgspec.defstruct("Inner", [("a", "field()")], namespace={"__module__": __name__})
    outer = msgspec.defstruct("Outer", [("inner", inner)])
    globals()["field"] = field
    try:
        heard(number, lambda: msgspec.inspect.type_info(outer))
    finally:
        del globals()["field"]
    assert asked


@numbers
@pytest.mark.parametrize("file", ["<frozen importlib._bootstrap>", "/lib/logging/__init__.py"])
def test_while_a_lock_is_held(number: signal.Signals, file: str) -> None:
    passed: list[int] = []
    code = compile("signal.raise_signal(number)\npassed.append(1)", file, "exec")
    names = {"signal": signal, "number": number, "passed": passed}
    heard(number, lambda: exec(code, names))
    assert passed


@numbers
def test_while_a_module_is_imported(
    number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Modules in C cannot be imported by halves, and say so in other words, or not at all."""
    (tmp_path / "outer_one.py").write_text("from inner_one import imported\n")
    code = "import signal\nimported = 0\nsignal.raise_signal({})\nimported = 1\n"
    (tmp_path / "inner_one.py").write_text(code.format(int(number)))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "inner_one", raising=False)
    monkeypatch.delitem(sys.modules, "outer_one", raising=False)
    heard(number, lambda: importlib.import_module("outer_one"))
    assert sys.modules["outer_one"].imported == 1


@numbers
@pytest.mark.parametrize("place", ["msgspec/venv/tool.py", "<frozen importlib._bootstrap>"])
def test_where_the_tool_lies_and_who_has_called_it_does_not_matter(
    number: signal.Signals, place: str
) -> None:
    """Such as a tool in a folder with the name of a package, or one that is called in an import."""
    code = compile("heard(number, lambda: signal.raise_signal(number))", place, "exec")
    exec(code, {"heard": heard, "signal": signal, "number": number})


def test_what_else_is_dropped_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    told: list[object] = []
    before, sys.unraisablehook = sys.unraisablehook, told.append
    try:
        with heeded():

            class Fails:
                def __del__(self) -> None:
                    raise ValueError("told")

            Fails()
        assert sys.unraisablehook == told.append
    finally:
        sys.unraisablehook = before
    assert len(told) == 1


def test_afterwards_all_is_as_it_was() -> None:
    before = [signal.getsignal(number) for number in EXCEPTIONS], sys.unraisablehook
    with heeded():
        assert signal.getsignal(signal.SIGTERM) != before[0][1]
    assert ([signal.getsignal(number) for number in EXCEPTIONS], sys.unraisablehook) == before


def test_ctrl_c_that_is_ignored_stays_so() -> None:
    """As under `nohup`, or in the background of a shell: the command goes on and ends well."""
    code = (
        "import os, signal\n"
        "from coursebuild.cli.interrupts import heeded\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "with heeded():\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    for _ in range(1000): pass\n"
        "    print('goes on')\n"
        "print(signal.getsignal(signal.SIGINT) is signal.SIG_IGN)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "goes on\nTrue\n", "")


@numbers
@pytest.mark.parametrize("threads", [0, 1])
def test_when_the_command_is_through_and_the_process_ends(
    number: signal.Signals, threads: int
) -> None:
    code = (
        "import os, signal, sys, threading, time\n"
        f"for _ in range({threads}):\n"
        "    threading.Thread(target=time.sleep, args=(60,), daemon=True).start()\n"
        "from coursebuild.cli.interrupts import heeded\n"
        "with heeded(alone=True): pass\n"
        "os.kill(os.getpid(), int(sys.argv[1]))\n"
        "for _ in range(1000): pass\n"
        "sys.exit(5)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(int(number))], cwd=ROOT)
    assert done.returncode == 5


def test_an_interrupt_out_of_an_executed_text_does_not_decide_how_the_process_ends() -> None:
    code = (
        "import sys\n"
        "from coursebuild.cli.interrupts import heeded\n"
        "with heeded(alone=True):\n"
        "    try: exec('raise KeyboardInterrupt')\n"
        "    except KeyboardInterrupt: pass\n"
        "sys.exit(130)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 130


def test_in_another_thread_nothing_is_changed() -> None:
    found: list[object] = []

    def look() -> None:
        with heeded():
            found.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert found == [signal.getsignal(signal.SIGTERM)]
