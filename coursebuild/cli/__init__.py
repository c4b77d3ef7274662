"""The command line: arguments → pipeline → exit status.

Entry point: `main(arguments)`. Exit status 0: clean; 1: something is wrong in the course; 2: wrong
usage. Heavy imports happen in the command that needs them.

- `unchanged`: a command with nothing to do, which loads no more than that
- `running`: memory, and what a command ends with
- `interrupts`: Ctrl-C and SIGTERM, wherever they come
- `commands`: which there are; those of every course have a module each (`build`, `check`, …), and
  features bring further ones
- `pytest_plugin`: the same as tests of pytest
- `arguments`: what several commands take
- `output`: what is written where, and the status that says it too
"""

from __future__ import annotations

import atexit
import os
import sys

from coursebuild.cli.output import CLEAN, INTERRUPTED, USAGE, WRONG, say, write
from coursebuild.cli.unchanged import said_before, split_directory

TYPE_CHECKING = False
"""As type checkers know it: to import `typing` takes a tenth of a run with nothing to do."""
if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name; gives the exit status.

    Without arguments it is the command of this process, which ends with it.
    """
    _utf8_streams()
    if sys.platform == "win32":
        return say(USAGE, "coursebuild runs on Linux and macOS; on Windows, install it in WSL")
    given = sys.argv[1:] if arguments is None else list(arguments)
    try:
        directory, words = split_directory(given)
        said = said_before(directory, words)
        if said is not None:
            return _end(write(said, CLEAN), alone=arguments is None)
        _occupy_streams()
        from coursebuild.cli.running import run
    except KeyboardInterrupt:
        return say(INTERRUPTED, "interrupted")
    except MemoryError:
        return say(WRONG, "coursebuild: there is not enough memory to begin")
    except OSError as error:
        return say(WRONG, f"coursebuild: it cannot be loaded: {error}")
    return _end(run(directory, words, alone=arguments is None), alone=arguments is None)


def _end(status: int, *, alone: bool) -> int:
    """End this process at once, if it is one command's.

    Python would give all its memory back, object by object: for a large course that takes seconds,
    in which Ctrl-C seems to do nothing.
    """
    if not alone:
        return status
    atexit._run_exitfuncs()  # of others: what is left open is closed, as ever
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # there is none where the tool was started without one
            try:
                stream.flush()
            except (OSError, ValueError):
                continue
    os._exit(status)


def _occupy_streams() -> None:
    """Keep 0, 1 and 2, where they are closed, from the pipes to processes."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)


def _utf8_streams() -> None:
    """Reports hold whatever a lesson holds, so they are UTF-8 whatever the locale says."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(encoding="utf-8", errors="replace")
