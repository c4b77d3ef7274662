"""The end of this process, at once.

Entry point: `exit_immediately(status)`. Python gives all its memory back before it exits, object by
object: for a large course in memory that takes seconds, in which Ctrl-C seems to do nothing.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from typing import NoReturn


def exit_immediately(status: int) -> NoReturn:
    """Exit, once streams are flushed; whoever calls has ended all else that others can see."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # there is none where the tool was started without one
            try:
                stream.flush()
            except (OSError, ValueError):
                continue
    os._exit(status)
