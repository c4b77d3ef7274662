"""The start of the command `mjbench`, and of `python -m mjbench`."""

import os
import signal
import sys


def main() -> int:
    """Run the command; what it starts takes nothing from the folder in which it is given.

    MuJoCo's import starts Python, and engines start compilers. That folder may be a stranger's.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    places = filter(os.path.isabs, os.environ.get("PATH", os.defpath).split(os.pathsep))
    os.environ["PATH"] = os.pathsep.join(places)
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:  # a half-done import says nothing but a traceback
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from mjbench.cli import main as run

    signal.signal(signal.SIGINT, handler)
    return run()


if __name__ == "__main__":
    sys.exit(main())
