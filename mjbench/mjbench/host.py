"""What measuring asks of whoever started it: progress, code to run, files that others know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol

from msgspec import Struct

from mjbench import exact

EXACT_SCRIPT = exact.__file__
"""The script that evaluates an exact motion."""


class ExactRun(Struct, frozen=True):
    """What running the file of an exact motion gave."""

    output: str
    failure: str = ""
    """Why it did not run to its end, in words; empty where it did."""


class Host(Protocol):
    """Whoever started a measurement."""

    def tell(self, text: str) -> None:
        """Say what is measured now."""

    def run_exact(self, path: str, query: str, seconds: float) -> ExactRun:
        """Run `exact.py` on a file with a query, for so many seconds of processor time."""

    def browser_speed(self, keyframe: int | None, duration: float) -> float | None:
        """Simulated time over the time that it takes in a browser; `None` where not known."""
        return None

    def rerun(self, files: Mapping[str, bytes]) -> str:
        """The name of a program whose output changes with these files; empty if none does."""
        return ""


class LocalHost(Host):
    """This process: what code prints is looked at here, and there is no browser."""

    def __init__(self, folder: Path, tell: Callable[[str], None]) -> None:
        self.folder = folder
        self.say = tell

    def tell(self, text: str) -> None:
        """Say what is measured now."""
        self.say(text)

    def run_exact(self, path: str, query: str, _: float) -> ExactRun:
        """Evaluate the file here, as the user's other programs are."""
        try:
            return ExactRun(exact.answer(str(self.folder / path), query))
        except SystemExit:
            return ExactRun("", "it exits")
        except Exception as error:
            return ExactRun("", f"{type(error).__name__}: {error}")
