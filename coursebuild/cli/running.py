"""A command's memory, and the status that it ends with, also where a signal ends it.

Entry point: `run`.
"""

from __future__ import annotations

import argparse
import atexit
import gc

from coursebuild.cli.arguments import parser
from coursebuild.cli.interrupts import Terminated, heeded
from coursebuild.cli.output import INTERRUPTED, TERMINATED, USAGE, WRONG, fail, say
from coursebuild.core.files.errors import EffectError, PublishRefusedError, UsageError

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def run(given: Sequence[str], *, alone: bool) -> int:
    """Run the command that the arguments name; gives the exit status.

    `alone`: it is the command of this process, which ends with it.
    """
    collected = gc.get_threshold()
    # What a command makes lives until its end, and hardly any of it is in cycles: looking through
    # it takes time for nothing, most of all when the process ends and gives all of it back.
    gc.set_threshold(1_000_000 if alone else 200_000, 50, 50)
    if alone:
        atexit.register(gc.freeze)
    try:
        with heeded(alone=alone):
            return _run(given)
    finally:
        if not alone:
            gc.set_threshold(*collected)


def _run(given: Sequence[str]) -> int:
    try:
        options = parser(given).parse_args(given, argparse.Namespace(given=tuple(given)))
        command: Callable[[argparse.Namespace], int] = options.command
        return command(options)
    except UsageError as error:
        return fail(USAGE, str(error))
    except PublishRefusedError as error:
        return fail(USAGE, error.message, error.help)
    except EffectError as error:
        return fail(WRONG, error.message, error.help)
    except Terminated:
        return say(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return say(INTERRUPTED, "interrupted")
