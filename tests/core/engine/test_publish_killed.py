"""A site that is published over and over, and killed."""

from __future__ import annotations

import itertools
import os
import random
import signal
import time
from pathlib import Path
from typing import NoReturn

import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from coursebuild.core.model.results import OutputFile

pytestmark = pytest.mark.site


def names(folder: Path) -> list[str]:
    """What lies in a folder, but for the tool's own."""
    return sorted(p.name for p in folder.iterdir() if p.name != ".coursebuild")


def publish_for_ever(root: Path, same: int, told: int) -> NoReturn:
    """One site after another, of whose files so many stay the same; each is told of."""
    try:
        for i in itertools.count():
            text = str(i).encode()
            files = [OutputFile(f"{k}/index.html", text) for k in range(30 - same)]
            files += [OutputFile(f"{k}/same.html", b"same") for k in range(same)]
            publish(root, root / "public", files)
            os.write(told, b".")
    finally:
        os._exit(1)


@pytest.mark.parametrize("same", [0, 25])
def test_killed_at_any_time(tmp_path: Path, same: int) -> None:
    """A real SIGKILL, wherever it hits."""
    chance = random.Random(42)
    publish(tmp_path, tmp_path / "public", [OutputFile("0/index.html", b"first")])
    for _ in range(12):
        hears, told = os.pipe()
        build = os.fork()
        if build == 0:
            publish_for_ever(tmp_path, same, told)
        os.close(told)
        os.read(hears, 1)
        time.sleep(chance.uniform(0.0, 0.02))  # nothing is waited for: the instant is any
        os.kill(build, signal.SIGKILL)
        assert os.waitstatus_to_exitcode(os.waitpid(build, 0)[1]) == -signal.SIGKILL
        os.close(hears)
        pages = list((tmp_path / "public").rglob("*.html"))
        assert len({p.read_bytes() for p in pages if p.name == "index.html"}) == 1
        listed = (tmp_path / "public" / MARKER).read_text().split("\n")[1:-1]
        assert len(listed) == len(pages)
    publish(tmp_path, tmp_path / "public", [OutputFile("a.html", b"last")])
    assert names(tmp_path) == ["public"]
