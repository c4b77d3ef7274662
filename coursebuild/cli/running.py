"""A command's memory, and the status that it ends with, also where a signal ends it.

Entry point: `run`.
"""

from __future__ import annotations

import atexit
import gc
import resource

from coursebuild.cli.commands import run_command
from coursebuild.cli.interrupts import Terminated, heeded
from coursebuild.cli.output import INTERRUPTED, TERMINATED, USAGE, WRONG, fail, say
from coursebuild.core.files.errors import (
    EffectError,
    PublishRefusedError,
    UsageError,
    lacking,
)

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Sequence


_FILES = 64
"""Pipes of processes, the store, event loops, what scripts open."""


def run(directory: str | None, words: Sequence[str], *, alone: bool) -> int:
    """Run the command that the words name, in a folder; gives the exit status.

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
            return _run(directory, words)
    except Terminated:
        return say(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return say(INTERRUPTED, "interrupted")
    finally:
        if not alone:
            gc.set_threshold(*collected)


def _run(directory: str | None, words: Sequence[str]) -> int:
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if files < _FILES:
        message = f"only {files} files may be open at a time, and {_FILES} are needed"
        return fail(WRONG, message, f"`ulimit -n {4 * _FILES}` raises the limit")
    try:
        return run_command(directory, words)
    except UsageError as error:
        return fail(USAGE, str(error))
    except PublishRefusedError as error:
        return fail(USAGE, error.message, error.help)
    except EffectError as error:
        return fail(WRONG, error.message, error.help)
    except (MemoryError, OSError, RuntimeError) as error:
        lack = lacking(error)
        if lack is None:
            raise
        return fail(WRONG, lack.message, lack.help)
