"""The command line: arguments → pipeline → exit status.

Exit status 0: clean; 1: something is wrong in the course; 2: wrong usage. Heavy imports happen in
the command that needs them, and here in `main`: first `unchanged`, for a command that has nothing
to do, then `commands`, which runs one of the modules here, or of features.
"""

from __future__ import annotations

import os
import signal
import sys

from coursebuild.output import CLEAN, FAILURE, USAGE, say, write


def main(arguments: list[str] | tuple[str, ...] | None = None) -> int:
    """Run a command; return its exit status. Without arguments it is that of this process."""
    alone = arguments is None
    if alone and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # Until there is something to clean up, Ctrl-C ends this process at once. Python would show
        # where it is, which is in an import.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):  # in any locale a report may hold any text of a lesson
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(encoding="utf-8", errors="replace")
    if sys.platform == "win32":
        return say(USAGE, "coursebuild runs on Linux and macOS; on Windows, install it in WSL")
    if alone:
        # What libraries start by themselves, as Dask does, obeys no file of the course either.
        os.environ["PYTHONSAFEPATH"] = "1"
        places = filter(os.path.isabs, os.environ.get("PATH", os.defpath).split(os.pathsep))
        os.environ["PATH"] = os.pathsep.join(places) or os.defpath  # empty, it would mean `.`
    try:
        from coursebuild.cli.unchanged import previous_output, split_directory

        directory, words = split_directory(sys.argv[1:] if arguments is None else [*arguments])
        output = previous_output(directory, words)
        if output is not None:
            return write(output, CLEAN)
        # If the descriptors 0, 1 and 2 are closed, no pipe gets their numbers.
        while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
            pass
        os.close(number)
        from coursebuild.cli.commands import run
    except MemoryError:
        return say(FAILURE, "coursebuild: not enough memory to start")
    except OSError as error:
        return say(FAILURE, f"coursebuild: loading failed: {error}")
    return run(directory, words, alone=alone)
