"""Killing the tool at every point of a build, an extraction and an update."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coursebuild.effects import locks
from coursebuild.effects.site_swap import MARKER, publish
from coursebuild.results import OutputFile

ROOT = Path(locks.__file__).parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def names(folder: Path) -> list[str]:
    """What lies in a folder, but for the tool's own."""
    return sorted(p.name for p in folder.iterdir() if p.name != ".coursebuild")


@pytest.mark.parametrize(
    ("scenario", "at_least"),
    [
        ("Publish", 30),
        ("PublishByRenames", 30),
        ("PublishAgain", 30),
        ("PublishFirst", 20),
        ("Update", 8),
        ("Create", 8),
        ("Extract", 20),
        ("ExtractAndChange", 20),
    ],
)
def test_killed_at_every_call(tmp_path: Path, scenario: str, at_least: int) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "tests/support/killed_writers.py", scenario, tmp_path],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= at_least


BUILD = """
import itertools, sys
from pathlib import Path
from coursebuild.effects.site_swap import publish
from coursebuild.results import OutputFile
root, same = Path(sys.argv[1]), int(sys.argv[2])
print("ready", flush=True)
for i in itertools.count():
    text = str(i).encode()
    files = [OutputFile(f"{k}/index.html", text) for k in range(30 - same)]
    files += [OutputFile(f"{k}/same.html", b"same") for k in range(same)]
    publish(root, root / "public", files)
"""


@pytest.mark.parametrize("same", [0, 25])
def test_killed_at_any_time(tmp_path: Path, same: int) -> None:
    """A real SIGKILL, wherever it hits."""
    chance = random.Random(42)
    publish(tmp_path, tmp_path / "public", [OutputFile("0/index.html", b"first")])
    for _ in range(12):
        build = subprocess.Popen(
            [sys.executable, "-c", BUILD, tmp_path, str(same)],
            stdout=subprocess.PIPE,
            env=ENVIRONMENT,
        )
        with build:
            assert build.stdout is not None
            build.stdout.readline()
            time.sleep(chance.uniform(0.0, 0.05))
            build.send_signal(signal.SIGKILL)
        pages = list((tmp_path / "public").rglob("*.html"))
        assert len({p.read_bytes() for p in pages if p.name == "index.html"}) == 1
        listed = (tmp_path / "public" / MARKER).read_text().split("\n")[1:-1]
        assert len(listed) == len(pages)
    publish(tmp_path, tmp_path / "public", [OutputFile("a.html", b"last")])
    assert names(tmp_path) == ["public"]
