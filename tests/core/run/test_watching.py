"""Whether the process that started this one has ended."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from coursebuild.core.run.watching import has_ended

pytestmark = pytest.mark.site

PARENT = """
import os, sys
from coursebuild.core.run.watching import has_ended
inside, outside = os.pipe()
hears, says = os.pipe()
tool = os.getpid()
if os.fork() == 0:
    os.close(outside)
    before = has_ended(tool)
    os.write(says, b"!")
    os.read(inside, 1)  # returns when the parent's end is closed, as the first of what it loses
    os.write(1, b"%d%d" % (before, has_ended(tool)))
    os._exit(0)
os.read(hears, 1)
END
"""


def ended(end: str) -> str:
    """What a child says of its parent while that lives, and when it finds its pipe closed."""
    code = PARENT.replace("END", end)
    return subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True).stdout


def test_a_parent_that_lives_has_not_ended() -> None:
    assert not has_ended(os.getppid())


def test_another_process_is_no_parent() -> None:
    assert has_ended(os.getpid())


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says that a process is exiting")
@pytest.mark.parametrize(
    "end", ["os.kill(tool, 9)", "os._exit(0)", "sys.exit(0)", "import time; os.kill(tool, 15)"]
)
def test_a_parent_has_ended_as_soon_as_its_files_are_closed(end: str) -> None:
    assert [ended(end) for _ in range(5)] == ["01"] * 5


def test_a_parent_that_closes_the_pipe_and_lives_has_not_ended() -> None:
    assert ended("os.close(outside); os.waitpid(-1, 0)") == "00"
