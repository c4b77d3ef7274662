"""Ctrl-C and SIGTERM take effect wherever they come."""

from __future__ import annotations

import importlib
import signal
import sys
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from coursebuild.cli.interrupts import Terminated, signals_as_exceptions
from support.run_code import run_code

EXCEPTIONS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}
pytestmark = pytest.mark.site
numbers = pytest.mark.parametrize("number", EXCEPTIONS)


def assert_takes_effect(number: signal.Signals, act: Callable[[], object]) -> None:
    """Assert that a signal which comes during an action takes effect, if only later."""
    with pytest.raises(EXCEPTIONS[number]) as caught, signals_as_exceptions():
        act()
        time.sleep(120)  # it ends as soon as the signal comes again
    assert caught.type is EXCEPTIONS[number]


@numbers
def test_signal_is_heard_where_python_drops_what_is_raised(number: signal.Signals) -> None:
    """When an object is deleted, when its last reference goes, when a process was forked."""

    class Goes:
        def __del__(self) -> None:
            signal.raise_signal(number)

    class Referred:
        pass

    def refer() -> None:
        referrer = Referred()
        referrer.reference = weakref.ref(referrer, lambda _: None)
        references.append(weakref.ref(referrer, lambda _: signal.raise_signal(number)))

    references: list[weakref.ref[Referred]] = []
    assert_takes_effect(number, lambda: signal.raise_signal(number))
    assert_takes_effect(number, Goes)
    assert_takes_effect(number, refer)
    result = run_code(
        "import os, signal, sys, time\n"
        "from coursebuild.cli.interrupts import signals_as_exceptions\n"
        "number = int(sys.argv[1])\n"
        "os.register_at_fork(after_in_parent=lambda: signal.raise_signal(number))\n"
        "try:\n"
        "    with signals_as_exceptions():\n"
        "        if os.fork() == 0: os._exit(0)\n"
        "        time.sleep(60)\n"
        "except KeyboardInterrupt as error: print(type(error).__name__)\n",
        int(number),
    )
    assert (result.stdout, result.stderr) == (f"{EXCEPTIONS[number].__name__}\n", "")


@numbers
def test_signal_is_heard_of_which_a_library_makes_another_exception(
    number: signal.Signals,
) -> None:
    def load() -> None:
        try:
            signal.raise_signal(number)
        except KeyboardInterrupt:
            raise RuntimeError("this error is not expected ever to occur") from None

    assert_takes_effect(number, load)


@numbers
def test_signal_waits_while_msgspec_looks_at_a_type(number: signal.Signals) -> None:
    """An exception where its C code calls Python would end the process."""
    calls: list[int] = []

    def field() -> type:
        if not calls:
            calls.append(1)
            signal.raise_signal(number)
        return int

    inner = msgspec.defstruct("Inner", [("a", "field()")], namespace={"__module__": __name__})
    outer = msgspec.defstruct("Outer", [("inner", inner)])
    globals()["field"] = field
    try:
        assert_takes_effect(number, lambda: msgspec.inspect.type_info(outer))
    finally:
        del globals()["field"]
    assert calls


@numbers
def test_signal_waits_while_a_module_is_imported_or_a_lock_is_held(
    number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Modules in C cannot be imported in part, and raise other exceptions then, or none."""
    (tmp_path / "outer_one.py").write_text("from inner_one import imported\n")
    code = "import signal\nimported = 0\nsignal.raise_signal({})\nimported = 1\n"
    (tmp_path / "inner_one.py").write_text(code.format(int(number)))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "inner_one", raising=False)
    monkeypatch.delitem(sys.modules, "outer_one", raising=False)
    assert_takes_effect(number, lambda: importlib.import_module("outer_one"))
    assert sys.modules["outer_one"].imported == 1
    steps: list[str] = []
    names = {"signal": signal, "number": number, "passed": steps}
    for file in ("<frozen importlib._bootstrap>", "/lib/logging/__init__.py"):
        locked = compile("signal.raise_signal(number)\npassed.append(1)", file, "exec")
        assert_takes_effect(number, lambda locked=locked: exec(locked, names))
    assert len(steps) == 2
    # Neither the tool's folder nor its caller matters.
    for place in ("msgspec/venv/tool.py", "<frozen importlib._bootstrap>"):
        code = "heard(number, lambda: signal.raise_signal(number))"
        exec(compile(code, place, "exec"), {"heard": assert_takes_effect, **names})


LOADING = (
    *("coursebuild.cli.unchanged", "coursebuild.core.engine.up_to_date", "hashlib"),
    *("coursebuild.cli.running", "coursebuild.cli.interrupts", "argparse"),
)


def test_ctrl_c_while_the_tool_is_loaded_ends_it_without_a_word() -> None:
    """A traceback through imports is of no use to anybody; there is nothing to clean up yet."""
    code = (
        "import os, signal, sys\n"
        "def interrupt(event, arguments):\n"
        "    if event == 'import' and arguments[0] == sys.argv[-1]:\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "sys.addaudithook(interrupt)\n"
        "from coursebuild.cli import main\n"
        "main()\n"
    )
    for module in LOADING:
        result = run_code(code, "check", module)
        assert (result.returncode, result.stdout, result.stderr) == (-signal.SIGINT, "", ""), module


def test_afterwards_all_is_as_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    before = [signal.getsignal(number) for number in EXCEPTIONS], sys.unraisablehook
    with signals_as_exceptions():
        assert signal.getsignal(signal.SIGTERM) != before[0][1]
    assert ([signal.getsignal(number) for number in EXCEPTIONS], sys.unraisablehook) == before
    reports: list[object] = []
    sys.unraisablehook = reports.append
    try:
        with signals_as_exceptions():  # other dropped exceptions are reported

            class Fails:
                def __del__(self) -> None:
                    raise ValueError("told")

            Fails()
        assert sys.unraisablehook == reports.append
    finally:
        sys.unraisablehook = before[1]
    assert len(reports) == 1


def test_nothing_is_changed_where_signals_are_ignored_or_in_another_thread() -> None:
    """As under `nohup`, or in the background of a shell: the command goes on and ends well."""
    result = run_code(
        "import os, signal\n"
        "from coursebuild.cli.interrupts import signals_as_exceptions\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "with signals_as_exceptions():\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    for _ in range(1000): pass\n"
        "    print('goes on')\n"
        "print(signal.getsignal(signal.SIGINT) is signal.SIG_IGN)\n"
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, "goes on\nTrue\n", "")
    handlers: list[object] = []

    def look() -> None:
        with signals_as_exceptions():
            handlers.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert handlers == [signal.getsignal(signal.SIGTERM)]


@numbers
def test_signal_does_not_change_the_status_of_a_command_that_is_through(
    number: signal.Signals,
) -> None:
    for threads in (0, 1):
        result = run_code(
            "import os, signal, sys, threading, time\n"
            f"for _ in range({threads}):\n"
            "    threading.Thread(target=time.sleep, args=(60,), daemon=True).start()\n"
            "from coursebuild.cli.interrupts import signals_as_exceptions\n"
            "with signals_as_exceptions(alone=True): pass\n"
            "os.kill(os.getpid(), int(sys.argv[1]))\n"
            "for _ in range(1000): pass\n"
            "sys.exit(5)\n",
            int(number),
        )
        assert result.returncode == 5
    result = run_code(  # nor does an interrupt from an executed text
        "import sys\n"
        "from coursebuild.cli.interrupts import signals_as_exceptions\n"
        "with signals_as_exceptions(alone=True):\n"
        "    try: exec('raise KeyboardInterrupt')\n"
        "    except KeyboardInterrupt: pass\n"
        "sys.exit(130)\n"
    )
    assert result.returncode == 130
