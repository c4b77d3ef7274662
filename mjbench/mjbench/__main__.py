"""The start of the command `mjbench`, and of `python -m mjbench`."""

import os
import sys


def main() -> int:
    """Run the command; what it starts takes nothing from the folder in which it is given.

    MuJoCo's import starts Python, and engines start compilers. That folder may be a stranger's.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    places = filter(os.path.isabs, os.environ.get("PATH", os.defpath).split(os.pathsep))
    os.environ["PATH"] = os.pathsep.join(places)
    from mjbench.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
