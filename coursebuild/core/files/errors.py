"""What can go wrong outside the course: full disks, places that must not be replaced.

A command turns it into one message and an exit status; it is never a bug of the tool, and never a
mistake inside a lesson (those are diagnostics).
"""

from __future__ import annotations

import errno
import os
from importlib.util import find_spec


class EffectError(Exception):
    """An effect outside the process failed or was refused.

    `message` says what is wrong, in lower case without a full stop; `help` says how to mend it.
    """

    def __init__(self, message: str, *, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help


class FileChangedError(EffectError):
    """A file has changed since it was read: replacing it would lose somebody's work."""


class OutsideProjectError(EffectError):
    """A path leads out of the project."""


class LackError(EffectError):
    """The machine has run out of something, or allows this process too little of it."""


class PublishRefusedError(EffectError):
    """The place where the site should go holds something that a site must not replace."""


class UsageError(Exception):
    """A command was called wrongly; the text is for the user. Exit status 2."""

    def __init__(self, message: str, *, help: str = "") -> None:
        super().__init__(f"{message}; {help}" if help else message)


def require(package: str, extra: str, purpose: str) -> None:
    """Raise an `EffectError`, unless a package of an extra is installed that `purpose` needs."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:  # a folder of that name is no package
        help = f"run `pip install 'coursebuild[{extra}]'`"
        raise EffectError(f"{purpose} needs the package {package}", help=help)


def reason(error: OSError) -> str:
    """The system's words for an error: `no space left on device`."""
    text = os.strerror(error.errno) if error.errno else str(error)
    return text[:1].lower() + text[1:]


def lacking(error: MemoryError | OSError | RuntimeError) -> LackError | None:
    """The error of a machine that has run out of something; `None` for all other errors."""
    if isinstance(error, MemoryError):
        return LackError("there is not enough memory")
    if isinstance(error, OSError) and error.errno in _HELP:
        return LackError(reason(error), help=_HELP[error.errno])
    if str(error) == "can't start new thread":
        return LackError(str(error), help=_HELP[errno.EAGAIN])
    return None


_HELP = {
    **dict.fromkeys((errno.ENFILE, errno.ENOMEM, errno.ENOSPC, errno.EDQUOT), ""),
    errno.EMFILE: "`ulimit -n 256` raises the limit",
    errno.EAGAIN: "`ulimit -u` says how many processes there may be",
    errno.EFBIG: "`ulimit -f` says how large a file may be",
}
"""The errors of resources that can run out, with how to get more."""
