"""Runs a command, and returns the status that it ends with, also where a signal ends it.

Entry point: `run`.
"""

from __future__ import annotations

import gc
import resource

from coursebuild.cli.commands import run_command
from coursebuild.cli.interrupts import Terminated, signals_as_exceptions
from coursebuild.cli.output import FAILURE, INTERRUPTED, TERMINATED, USAGE, fail, say
from coursebuild.core.files.errors import (
    EffectError,
    PublishRefusedError,
    UsageError,
    lacking,
)

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Sequence


_FILES_NEEDED = 64
"""For pipes of processes, the store, event loops, and what scripts open."""


def run(directory: str | None, words: Sequence[str], *, alone: bool) -> int:
    """Run the command that the words name, in a folder; return the exit status.

    `alone`: the command is that of this process, which ends with it.
    """
    thresholds = gc.get_threshold()
    # The objects of a command live until its end, and hardly any are in cycles: collecting garbage
    # takes time for nothing, most of all when the process ends.
    gc.set_threshold(1_000_000 if alone else 200_000, 50, 50)
    try:
        with signals_as_exceptions(alone=alone):
            return _run_command(directory, words)
    except Terminated:
        return say(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return say(INTERRUPTED, "interrupted")
    finally:
        if not alone:
            gc.set_threshold(*thresholds)


def _run_command(directory: str | None, words: Sequence[str]) -> int:
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if limit < _FILES_NEEDED:
        message = f"only {limit} files may be open at a time, and {_FILES_NEEDED} are needed"
        return fail(FAILURE, message, f"`ulimit -n {4 * _FILES_NEEDED}` raises the limit")
    try:
        return run_command(directory, words)
    except UsageError as error:
        return fail(USAGE, str(error))
    except PublishRefusedError as error:
        return fail(USAGE, error.message, error.help)
    except EffectError as error:
        return fail(FAILURE, error.message, error.help)
    except (MemoryError, OSError, RuntimeError) as error:
        lack = lacking(error)
        if lack is None:
            raise
        return fail(FAILURE, lack.message, lack.help)
