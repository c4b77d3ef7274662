"""What the command line writes, and the exit status that says the same.

Entry points: `write`, `say`, `fail`; `print_report`, `report_text`.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from typing import TextIO

    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report, Style

CLEAN, WRONG, USAGE, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143


def fail(status: int, message: str, help: str = "") -> int:
    """Say what is wrong on standard error; gives the status."""
    return say(status, f"coursebuild: {message}" + (f"\n  help: {help}" if help else ""))


def say(status: int, text: str) -> int:
    """Write a text to standard error; gives the status."""
    if sys.stderr is not None:  # print would take standard output in its place
        try:
            print(text, file=sys.stderr, flush=True)
        except OSError:  # nobody reads it; the status says it too
            return status
    return status


def write(text: str, status: int) -> int:
    """Write to standard output; gives the status, another one where the text cannot be written."""
    if sys.stdout is None:  # closed by whoever started us
        return status
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough; what was found is as it was
        _forget_stdout()
    except OSError as error:
        from coursebuild.core.files.errors import reason

        _forget_stdout()
        return fail(WRONG, f"standard output cannot be written: {reason(error)}")
    return status


def _forget_stdout() -> None:
    """Python writes what is left once more when it ends, and would complain."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


def print_report(report: Report, form: str, options: Options) -> int:
    """Write a report in one of its formats; gives the status that says whether all is well."""
    options.store.close()
    return write(report_text(report, form, options), CLEAN if report.ok else WRONG)


def report_text(report: Report, form: str, options: Options) -> str:
    """The report as it is printed: as text only what is wrong, where the user wants no more."""
    from msgspec.structs import replace

    from coursebuild.report import render_report

    if options.quiet and form == "text":
        if not report.diagnostics:
            return ""
        report = replace(report, scripts=(), labs=(), remarks=(), sensitivity=None)
    return render_report(report, form, style_of(sys.stdout))


def look(stream: TextIO | None) -> tuple[bool, int]:
    """Whether to colour, and how many columns there are.

    Colour on a terminal, unless its user asks for none (https://no-color.org), and wherever the
    user asks for it (https://force-color.org).
    """
    terminal = stream is not None and stream.isatty()
    wanted = terminal and os.environ.get("TERM") != "dumb"
    colour = bool(wanted or os.environ.get("FORCE_COLOR")) and not os.environ.get("NO_COLOR")
    if not terminal:
        return colour, 100
    import shutil

    return colour, shutil.get_terminal_size((100, 24)).columns


def style_of(stream: TextIO | None) -> Style:
    """How text on a stream should look."""
    from coursebuild.report import Style

    return Style(*look(stream))
