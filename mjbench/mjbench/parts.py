"""Runs the parts of a measurement so that one that fails takes no other with it.

An author's mistake, a `SceneError`, ends the whole: measuring the rest would not help them. Where
the user stops (Ctrl-C), parts that have not begun are skipped, and what is known is reported. Where
time is limited, each part has a share of what is left: a long one leaves some to the others.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from mjbench.loop import TimeLimitError, time_left, time_limit
from mjbench.reports import PartFailure
from mjbench.scene import SceneError

STOPPED = "stopped before it was done"
"""The reason of parts that the user did not wait for."""
LATE = "not enough time"
"""The reason of parts that a limit of time ended."""
_T = TypeVar("_T")


class Parts:
    """The parts of a measurement, and those that there are not."""

    def __init__(self, tell: Callable[[str], None] = lambda _: None) -> None:
        self.tell = tell
        self.failures: list[PartFailure] = []
        self.stopped = False

    def run(
        self,
        name: str,
        measure: Callable[[], _T],
        default: _T,
        *,
        share: float = 1.0,
        at_once: bool = False,
    ) -> _T:
        """The result of a part, or `default` where it fails or the user has stopped.

        `share`: of the time that is left; `at_once`: it measures nothing, so that nobody waits for
        it, and is made after a stop too.
        """
        if self.stopped and not at_once:
            self.failures.append(PartFailure(name, STOPPED))
            return default
        try:
            self.tell(name)
            with time_limit(share * time_left()):
                return measure()
        except SceneError:
            raise
        except TimeLimitError:
            self.failures.append(PartFailure(name, LATE))
        except KeyboardInterrupt:
            self.stopped = True
            self.failures.append(PartFailure(name, STOPPED))
        except Exception as error:
            self.failures.append(PartFailure(name, describe(error)))
        return default

    def collect(self, name: str, results: Iterable[_T], *, share: float = 1.0) -> list[_T]:
        """All results of a part that gives one after the other, or those until it failed."""
        collected: list[_T] = []

        def take() -> None:
            for result in results:  # one by one: those until it failed are kept
                collected.append(result)

        self.run(name, take, None, share=share)
        return collected


def describe(error: Exception) -> str:
    """An error, and where it arose."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    words = " ".join(str(error).split())
    return f"{type(error).__name__}{f': {words}' if words else ''}{place}"
