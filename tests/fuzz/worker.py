"""A process that tries one target: `python -m fuzz.worker TARGET FOLDER OPTIONS-OF-LIBFUZZER…`."""

from __future__ import annotations

import hashlib
import json
import sys
import time
import traceback
from pathlib import Path
from typing import Any

import atheris

PACKAGES = ["coursebuild", "markdown_it", "mdit_py_plugins"]
SECONDS, PER_CHARACTER = 1.0, 0.002
"""Processor time that an input may take; instrumented code is some four times as slow."""
REPEAT_INTERVAL = 150
"""Of so many inputs one is repeated."""
SIZE, GROWTH = 4000, 24
"""Characters of a repeated input, and how often the time of eight times them may be theirs."""


class SlownessError(Exception):
    """An input takes too long."""


class Attempts:
    """The inputs that are tried, and what was wrong with some."""

    def __init__(self, target: Any, folder: Path) -> None:
        self.target = target
        self.folder = folder
        self.count = 0
        self.signatures: set[str] = set()

    def __call__(self, data: bytes) -> None:
        self.count += 1
        try:
            seconds = self.seconds(data)
            if seconds > SECONDS + PER_CHARACTER * len(data):
                raise SlownessError(f"{len(data)} bytes take {seconds:.1f} s")
            if self.target.repeatable and data and self.count % REPEAT_INTERVAL == 0:
                self.repeat(data)
        except Exception as error:
            self.note(data, error)

    def seconds(self, data: bytes) -> float:
        start = time.process_time()
        self.target.attempt(data)
        return time.process_time() - start

    def repeat(self, data: bytes) -> None:
        """Time grows with the text, and no faster."""
        few = data * (SIZE // len(data) + 1)
        for _ in range(3):  # whatever else the machine does
            before = self.seconds(few)
            after = self.seconds(few * 8)
            if after < 1 or after < GROWTH * before:
                return
        raise SlownessError(
            f"repeated, eight times the text takes {after / before:.0f} times as long"
        )

    def note(self, data: bytes, error: Exception) -> None:
        """Keep the input of a mistake that was not found yet."""
        frames = traceback.extract_tb(error.__traceback__)
        place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}"
        if isinstance(error, SlownessError):
            place = str(error).split()[0]
        signature = f"{type(error).__name__} {place}"
        if signature not in self.signatures:
            self.signatures.add(signature)
            name = f"found-{hashlib.sha256(data).hexdigest()[:12]}"
            (self.folder / name).write_bytes(data)
            lines = traceback.format_exception(error)
            (self.folder / f"{name}.json").write_text(json.dumps([signature, "".join(lines)]))


def main() -> None:
    name, folder, *options = sys.argv[1:]
    with atheris.instrument_imports(include=PACKAGES):
        from fuzz.targets import TARGETS
    attempts = Attempts(TARGETS[name], Path(folder))
    for path in sorted(Path(folder).glob("found-*.json")):
        attempts.signatures.add(json.loads(path.read_text())[0])
    atheris.Setup([sys.argv[0], *options], attempts)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
