"""Ctrl-C and SIGTERM end a command, whatever it is doing."""

from __future__ import annotations

import signal
import threading

import pytest

from coursebuild.cli import main
from support.run_code import run_code

pytestmark = pytest.mark.site
numbers = pytest.mark.parametrize(
    ("number", "status", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
COMMAND = """
import os, signal, sys
number = signal.Signals(int(sys.argv.pop()))
def during_import(event, arguments):
    if event == "import" and arguments[0] == sys.argv[-1]:
        {}
signal.signal(signal.SIGINT, {})
sys.addaudithook(during_import)
from coursebuild.cli import main
sys.exit(main())
"""
"""A command; its last arguments: a module during whose import something happens, and a signal."""


@numbers
def test_signal_ends_a_command_wherever_it_is(
    number: signal.Signals, status: int, word: str
) -> None:
    """Libraries in C make another exception of it, as in an import that fails."""
    becomes_another = (
        "try: signal.raise_signal(number)\n"
        "        except KeyboardInterrupt: raise ImportError('not expected ever') from None"
    )
    for code in ("signal.raise_signal(number)", becomes_another):
        code = COMMAND.format(code, "signal.default_int_handler")
        result = run_code(code, "schema", "coursebuild.core.syntax.schemas", int(number))
        assert (result.returncode, result.stdout, result.stderr) == (status, "", f"{word}\n")


def test_ctrl_c_while_the_tool_is_loaded_ends_it_without_a_word() -> None:
    """A traceback through imports is of no use to anybody; there is nothing to clean up yet."""
    code = COMMAND.format("signal.raise_signal(number)", "signal.default_int_handler")
    for module in ("coursebuild.cli.unchanged", "hashlib", "coursebuild.cli.commands", "argparse"):
        result = run_code(code, "check", module, int(signal.SIGINT))
        assert (result.returncode, result.stdout, result.stderr) == (-signal.SIGINT, "", ""), module


def test_ctrl_c_is_ignored_where_it_was_before() -> None:
    """As under `nohup`, or in the background of a shell: the command goes on and ends well."""
    code = COMMAND.format("signal.raise_signal(number)", "signal.SIG_IGN")
    for module in ("coursebuild.cli.unchanged", "coursebuild.core.syntax.schemas"):
        result = run_code(code, "schema", module, int(signal.SIGINT))
        assert result.returncode == 2
        assert result.stderr.startswith(f"coursebuild: there is no schema '{module}'")


def test_signal_does_not_change_the_status_of_a_command_that_is_through() -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        result = run_code(
            "import atexit, signal, sys\n"
            "atexit.register(signal.raise_signal, int(sys.argv.pop()))\n"
            "from coursebuild.cli import main\n"
            "sys.exit(main())\n",
            "schema",
            "quiz",
            int(number),
        )
        assert (result.returncode, result.stderr) == (0, "")


def test_afterwards_all_is_as_it_was() -> None:
    """Also in a thread, where no signal can be handled."""
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    statuses = [main(["--version"])]
    thread = threading.Thread(target=lambda: statuses.append(main(["--version"])))
    thread.start()
    thread.join()
    assert statuses == [0, 0]
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
