"""Scripts in parts: which part printed what, and that the script sees nothing of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import accumulate, pairwise
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.script_server import ScriptServer
from support.fixture_cases import fixture_tables, fixture_text
from support.runners import Run, both_ways, job

pytestmark = pytest.mark.site


def lines_of(parts: Sequence[str]) -> list[int]:
    """The lines at which further parts begin, where each part ends with its line."""
    return [1 + lines for lines in accumulate(part.count("\n") + 1 for part in parts[:-1])]


def outputs(result: ScriptRun) -> list[str]:
    edges = (0, *result.part_starts, len(result.stdout))
    return [result.stdout[start:end] for start, end in pairwise(edges)]


def test_each_part_has_what_it_printed(run: Run) -> None:
    nonblocking = ["import os\nos.set_blocking(1, False)\nprint('x' * 9000)", "print('b')"]
    last = ("an output that must not wait", nonblocking, ["x" * 9000 + "|", "b|"])
    for title, parts, expected in (*fixture_tables("script_parts")["printed"], last):
        result = run("\n".join(parts), part_lines=lines_of(parts))
        assert result.outcome is Outcome.OK, (title, result.stderr)
        assert outputs(result) == [text.replace("|", "\n") for text in expected], title


SEEN = fixture_text("scripts/seen_parts.txt")
WRONG = "def f(x):\n    return 1 / x\nprint('before')\nf(0)\nprint('after')\n"


@both_ways
def test_a_script_sees_nothing_of_its_parts(run: Run) -> None:
    whole, parted = run(SEEN), run(SEEN, part_lines=(3, 6, 7, 8, 10, 11, 14))
    assert (whole.stdout, whole.stderr) == (parted.stdout, parted.stderr)
    assert parted.outcome is Outcome.OK and len(parted.part_starts) == 7
    whole, parted = run(WRONG), run(WRONG, part_lines=(3, 4, 5))
    assert parted.outcome is Outcome.FAILED and 'x.py", line 4, in <module>' in parted.stderr
    assert (whole.stdout, whole.stderr) == (parted.stdout, parted.stderr)
    assert outputs(parted) == ["", "before\n", "", ""]


def test_what_was_printed_before_a_part_without_end_is_known(
    server: ScriptServer, root: Path
) -> None:
    code = "print('a')\nwhile True:\n    pass\n"
    (root / "examples/x.py").write_text(code)
    (result,) = server.run(root, [job(timeout=1.0, part_lines=[2])], parallel=1)
    assert result.outcome is Outcome.TIMEOUT and outputs(result) == ["a\n", ""]
    assert re.search(r'x\.py", line [23] in <module>', result.stderr)


def test_marks_of_an_output_beyond_the_limit_are_cut(run: Run) -> None:
    code = "print('x' * 600_000)\nprint('y' * 600_000)\nprint('z')\n"
    result = run(code, part_lines=(2, 3))
    assert result.outcome is Outcome.OUTPUT_LIMIT and result.stdout.startswith("x")
    assert "".join(outputs(result)) == result.stdout and set(outputs(result)[0]) == {"x", "\n"}
