"""The command line: arguments → pipeline → exit status.

Entry point: `main(arguments)`. Exit status 0: clean; 1: something is wrong in the course; 2: wrong
usage. Heavy imports happen in the command that needs them.

- `arguments`: what can be said
- `commands`: one function for each command
- `output`: what is written where, and the status that says it too
"""

from __future__ import annotations

import argparse
import gc
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from coursebuild.cli.arguments import parser
from coursebuild.cli.output import INTERRUPTED, TERMINATED, USAGE, WRONG, fail, say
from coursebuild.effects.errors import EffectError, PublishRefusedError, UsageError


class _Terminated(KeyboardInterrupt):
    """Somebody asked this process to end: what it has begun is cleaned up, as after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name; gives the exit status."""
    before = _heed_sigterm()
    collected = gc.get_threshold()
    # What a command makes lives until its end, and hardly any of it is in cycles.
    gc.set_threshold(200_000, 50, 50)
    try:
        return _main(arguments)
    finally:
        gc.set_threshold(*collected)
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _heed_sigterm() -> Any:
    """Make SIGTERM an exception; gives the handler there was, or nothing where it is left alone."""
    if threading.current_thread() is not threading.main_thread():
        return None

    def terminate(*_: object) -> NoReturn:
        raise _Terminated

    return signal.signal(signal.SIGTERM, terminate)


def _main(arguments: Sequence[str] | None) -> int:
    _utf8_streams()
    options = parser().parse_args(arguments)
    try:
        command: Callable[[argparse.Namespace], int] = options.command
        return command(options)
    except UsageError as error:
        return fail(USAGE, str(error))
    except PublishRefusedError as error:
        return fail(USAGE, error.message, error.help)
    except EffectError as error:
        return fail(WRONG, error.message, error.help)
    except _Terminated:
        return say(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return say(INTERRUPTED, "interrupted")


def _utf8_streams() -> None:
    """Reports hold whatever a lesson holds, so they are UTF-8 whatever the locale says."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(encoding="utf-8", errors="replace")
