"""Processes that end with the one that started them, however that ends.

On Linux the system ends them, also in the middle of a computation. It does so when the *thread*
ends that started them, so they are for work that this thread waits for. Elsewhere, and where a
process has something to clean up, as those that run scripts have, it ends when it sees its input
close.
"""

import ctypes
import os
import signal
import sys
from collections.abc import Sequence

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def end_with_parent(parent: int) -> None:
    """Let this process, which `parent` has started, be killed when that ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it has just ended
        os._exit(1)


def bound_command(command: Sequence[str]) -> list[str]:
    """A command, to be started by this process, that ends with it."""
    return [sys.executable, "-I", "-S", __file__, str(os.getpid()), *command]


if __name__ == "__main__":
    end_with_parent(int(sys.argv[1]))
    os.execvp(sys.argv[2], sys.argv[2:])
