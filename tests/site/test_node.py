"""The tests of the browser's half that need no browser: Node runs them."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "site" / "tests").glob("*.test.mjs"))
FILES.append(ROOT / "editors" / "vscode" / "tests" / "course.test.mjs")
ENGINE = [path for path in FILES if "from './helpers.mjs'" in path.read_text("utf-8")]
"""Files whose tests start a lab engine."""
PLAIN = [path for path in FILES if path not in ENGINE]


@pytest.mark.site
@pytest.mark.parametrize(
    "files", [pytest.param(ENGINE, marks=pytest.mark.long), PLAIN], ids=["engine", "plain"]
)
def test_files_pass_under_node(files: list[Path]) -> None:
    """All in one process, which starts and warms up once."""
    if not (ROOT / "site" / "node_modules" / "@mujoco" / "mujoco").is_dir():
        pytest.fail("site/node_modules is not installed: run python site/bundle.py packages")
    node = runpy.run_path(str(ROOT / "site" / "bundle.py"))["find_node"]().node
    process = subprocess.run(
        [*node, "--test-reporter=tap", "--input-type=module"],
        input="".join(f"import {json.dumps(path.as_uri())}\n" for path in files),
        cwd=ROOT,
        env={**os.environ, "NODE_OPTIONS": ""},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert process.returncode == 0, f"{process.stdout}\n{process.stderr}"
    counts = dict(
        line[2:].split(" ", 1) for line in process.stdout.splitlines() if line[:2] == "# "
    )
    assert int(counts["pass"]) > 2 * len(files) > 10
    assert (counts["fail"], counts["skipped"], counts["todo"], counts["cancelled"]) == ("0",) * 4


def test_reference_values_are_those_of_this_mujoco() -> None:
    """The values that the JavaScript is compared with can be made again."""
    script = runpy.run_path(str(ROOT / "site" / "tests" / "native.py"))
    computed_values = json.loads(script["text"]())
    recorded_values = json.loads((ROOT / "site" / "tests" / "native.json").read_text("utf-8"))
    computed, recorded = dict(leaves(computed_values)), dict(leaves(recorded_values))
    assert computed == pytest.approx(recorded, rel=1e-10, abs=1e-12)


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """All numbers in a value by their paths in it; a text is the end of a path, to a zero."""
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(item, f"{path}/{key}")
    elif isinstance(value, str):
        yield f"{path}/{value}", 0.0
    else:
        yield path, value
