"""What can go wrong outside the course: full disks, places that must not be replaced.

Entry point: `EffectError`. The pipeline turns it into one message and an exit status; it is never a
bug of the tool, and never a mistake inside a lesson (those are diagnostics).
"""

from __future__ import annotations

import os


class EffectError(Exception):
    """The world outside refused.

    `message` says what, in lower case without a full stop; `help` says how to go on.
    """

    def __init__(self, message: str, *, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help


class FileChangedError(EffectError):
    """A file is no longer what was read: replacing it would lose somebody's work."""


class OutsideProjectError(EffectError):
    """A path leads out of the project."""


class PublishRefusedError(EffectError):
    """The place where the site should go holds something that a site must not replace."""


class UsageError(Exception):
    """The command was called in a way that cannot be; its text is for the user. Exit status 2."""

    def __init__(self, message: str, *, help: str = "") -> None:
        super().__init__(f"{message}; {help}" if help else message)


def reason(error: OSError) -> str:
    """The system's words for an error: `no space left on device`."""
    text = os.strerror(error.errno) if error.errno else str(error)
    return text[:1].lower() + text[1:]
