"""A harness of OSS-Fuzz. It tries the target that its file is named after, as `fuzz_lesson.py`.

PYTHONPATH=tests python fuzz_lesson.py [OPTION-OF-LIBFUZZER …] [FILE-OR-FOLDER …]
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["coursebuild", "markdown_it", "mdit_py_plugins"]):
    from fuzz.attempts import Attempts
    from fuzz.targets import TARGETS


def main() -> None:
    folder = tempfile.mkdtemp(prefix="fuzz-")
    os.environ["XDG_STATE_HOME"] = folder
    name = Path(sys.argv[0]).stem.removeprefix("fuzz_")
    attempts = Attempts(TARGETS[name], Path(folder))

    def TestOneInput(data: bytes) -> None:  # noqa: N802 - as all harnesses call it
        attempts.judge(data)

    atheris.Setup(sys.argv, TestOneInput)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
