"""A process that tries one target: `python -m fuzz.worker TARGET FOLDER OPTIONS-OF-LIBFUZZER…`."""

from __future__ import annotations

import sys
from pathlib import Path

import atheris

PACKAGES = ["coursebuild", "markdown_it", "mdit_py_plugins"]


def main() -> None:
    name, folder, *options = sys.argv[1:]
    with atheris.instrument_imports(include=PACKAGES):
        from fuzz.attempts import Attempts
        from fuzz.targets import TARGETS
    atheris.Setup([sys.argv[0], *options], Attempts(TARGETS[name], Path(folder)))
    atheris.Fuzz()


if __name__ == "__main__":
    main()
