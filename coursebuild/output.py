"""What commands write to standard output and error, and their exit status."""

from __future__ import annotations

import os
import sys

CLEAN, FAILURE, USAGE, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143
"""Exit status of commands: nothing is wrong, something in the course is, or the usage."""


def fail(status: int, message: str, help: str = "") -> int:
    """Write an error to standard error; return the status."""
    return say(status, f"coursebuild: {message}" + (f"\n  help: {help}" if help else ""))


def say(status: int, text: str) -> int:
    """Write a text to standard error; return the status."""
    show(_harmless(text))
    return status


def show(text: str) -> None:
    """Write a text, which has been made harmless, to standard error."""
    if sys.stderr is not None:  # else `print` would write to standard output
        try:
            print(text, file=sys.stderr, flush=True)
        except OSError:  # nobody reads it; the status says it too
            discard(sys.stderr.fileno())


def _harmless(text: str) -> str:
    """The text, such as one that names a file, which commands neither a terminal nor a service."""
    from coursebuild.core.text.characters import printable_lines, without_commands

    return without_commands(printable_lines(text))


def write(text: str, status: int, *, commands: bool = False) -> int:
    """Write to standard output; return the status, or another if the text cannot be written.

    `commands`: a CI service is meant to obey what it says.
    """
    if sys.stdout is None:  # closed by whoever started us
        return status
    try:
        sys.stdout.write(text if commands else _without_commands(text))
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough; the status stays
        discard(sys.stdout.fileno())
    except OSError as error:
        from coursebuild.core.files.errors import reason

        discard(sys.stdout.fileno())
        return fail(FAILURE, f"standard output cannot be written: {reason(error)}")
    return status


def _without_commands(text: str) -> str:
    if "::" not in text and "##" not in text:  # as nearly always
        return text
    from coursebuild.core.text.characters import without_commands

    return without_commands(text)


def discard(descriptor: int) -> None:
    """Keep Python from trying to write the rest once more at its end, and from complaining."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, descriptor)
    os.close(null)


def terminal_style(*, is_terminal: bool) -> tuple[bool, int]:
    """Return whether to use colours on a stream, and the number of its columns.

    Colours are used on a terminal, unless its user asks for none (https://no-color.org), and
    wherever the user asks for them (https://force-color.org).
    """
    is_capable = is_terminal and os.environ.get("TERM") != "dumb"
    colour = bool(is_capable or os.environ.get("FORCE_COLOR")) and not os.environ.get("NO_COLOR")
    if not is_terminal:
        return colour, 100
    import shutil

    return colour, shutil.get_terminal_size((100, 24)).columns
