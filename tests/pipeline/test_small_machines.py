"""Limits of a shell: messages say what is needed, and that is enough."""

from __future__ import annotations

import subprocess

import pytest

from support.scratch_course import GOOD, Folder, Make, block, command

pytestmark = pytest.mark.site


def run_limited(folder: Folder, limit: str, *arguments: str) -> tuple[int, str]:
    """The status of a command under a limit, and what it says on standard error."""
    result = subprocess.run(
        ["bash", "-c", f'ulimit {limit} && exec "$@"', "bash", *command(*arguments)],
        cwd=folder.root,
        env=folder.environment(),
        capture_output=True,
        text=True,
    )
    return result.returncode, result.stderr


def test_too_few_files_are_told_and_as_many_as_said_are_enough(make: Make) -> None:
    folder = make(GOOD + "$a_{17}$\n\n" + block("two.py", "print(2)", "2"))
    assert run_limited(folder, "-n 12", "check") == (
        1,
        "coursebuild: only 12 files may be open at a time, and 64 are needed\n"
        "  help: `ulimit -n 256` raises the limit\n",
    )
    status, output = run_limited(folder, "-n 64", "build", "--jobs", "2")
    assert status == 0, output


def test_too_few_addresses_for_v8_are_told(make: Make) -> None:
    folder = make(GOOD + "$a_{18}$\n")
    status, output = run_limited(folder, "-v 8388608", "check")
    assert status == 1
    assert "coursebuild: V8 needs more than the 8 GiB of addresses" in output
    assert "`ulimit -v unlimited`" in output
    assert "Traceback" not in output
