"""The command line: arguments → pipeline → exit status.

Entry point: `main(arguments)`. Exit status 0: clean; 1: something is wrong in the course; 2: wrong
usage. Heavy imports happen in the command that needs them, and here in `main`, which first lets
Ctrl-C end this process without a word.

- `unchanged`: a command that has nothing to do, for which little is loaded
- `running`: runs a command, and decides the status that it ends with
- `interrupts`: Ctrl-C and SIGTERM
- `commands`: the list of commands; each of the core has a module (`build`, `check`, …), and
  features have further ones
- `pytest_plugin`: checks of a course as tests of pytest
- `arguments`: arguments of several commands
- `output`: standard output and error, and the exit status
"""

from __future__ import annotations

import os
import sys

from coursebuild.cli.output import CLEAN, FAILURE, USAGE, say, write

TYPE_CHECKING = False
"""True for type checkers: importing `typing` takes a tenth of a run with nothing to do."""
if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name; return the exit status.

    Without arguments the command is that of this process, which ends with it.
    """
    alone = arguments is None
    if alone:
        _end_by_interrupt()
    _utf8_streams()
    if sys.platform == "win32":
        return say(USAGE, "coursebuild runs on Linux and macOS; on Windows, install it in WSL")
    all_words = sys.argv[1:] if arguments is None else list(arguments)
    try:
        from coursebuild.cli.unchanged import previous_output, split_directory

        directory, words = split_directory(all_words)
        output = previous_output(directory, words)
        if output is not None:
            return _end(write(output, CLEAN), alone=alone)
        _occupy_streams()
        from coursebuild.cli.running import run
    except MemoryError:
        return say(FAILURE, "coursebuild: there is not enough memory to begin")
    except OSError as error:
        return say(FAILURE, f"coursebuild: it cannot be loaded: {error}")
    return _end(run(directory, words, alone=alone), alone=alone)


def _end_by_interrupt() -> None:
    """Let Ctrl-C end this process at once, until a command begins that has something to clean up.

    Python would show where it is, which is in an import.
    """
    import signal

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where it is ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _end(status: int, *, alone: bool) -> int:
    """End this process at once if it is one command's.

    Python would free all its memory, object by object: for a large course that takes seconds, in
    which Ctrl-C seems to do nothing.
    """
    if not alone:
        return status
    import atexit

    atexit._run_exitfuncs()  # registered by libraries
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # the tool may have been started without one
            try:
                stream.flush()
            except (OSError, ValueError):
                continue
    os._exit(status)


def _occupy_streams() -> None:
    """Open the descriptors 0, 1 and 2 if they are closed, so that no pipe gets their numbers."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)


def _utf8_streams() -> None:
    """Make the streams UTF-8 in any locale, since reports may hold any text of a lesson."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(encoding="utf-8", errors="replace")
