"""How V8 gets into a process: with less memory, and with the same formulas."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.effects import v8

pytestmark = pytest.mark.engine

ROOT = Path(v8.__file__).parents[2]
FORMULAS = (
    r"\frac{a}{b} \not= \not\in \nexists",
    r"\mathbb{R} \mathfrak{Aa} \mathcal{L} \boldsymbol{\omega} \mathbf{é}",
    r"\text{Straße, ΑΒΓ, Ǆ, İı, 漢字, 🙂 and e\u0301}",
    r"\dot q \hat{x} \vec v \overline{ab} \tilde n",
    r"\begin{aligned} x &= 1 \\ y &= \sqrt[3]{2} \end{aligned}",
    "α + б + ℵ",
    r"\frac{a}",
    r"\nothing",
    "\ufdd0",
    r"\text{\u0000}",
    r"\color{nocolour} x",
    "x" * 20_001,
    r"\def\a{\a} \a",
)
SMAPS = Path("/proc/self/smaps_rollup")
CODE = """
import json, sys
from pathlib import Path
from coursebuild.effects import v8_start
from coursebuild.effects.v8 import Isolate, MathEngine
from coursebuild.results import Formula

if sys.argv[1] == "formulas":
    v8_start.for_formulas_only()
formulas = [Formula(tex, display) for tex in json.load(sys.stdin) for display in (False, True)]
with MathEngine() as engine:
    made = [x if isinstance(x, str) else [x.message, x.position] for x in engine.typeset(formulas)]
number = "(1234.5).toLocaleString('de')"
isolate = Isolate("function intl(x) { try { return " + number + " } catch { return '' } }")
intl = isolate.call("intl", "", 120.0)
isolate.close()
rollup = Path("/proc/self/smaps_rollup")
lines = rollup.read_text().splitlines() if rollup.exists() else []
sizes = {line.split(":")[0]: int(line.split()[1]) for line in lines if line.endswith("kB")}
print(json.dumps({"made": made, "intl": intl, "sizes": sizes}))
"""


@pytest.fixture(scope="module")
def found() -> dict[str, dict[str, object]]:
    """What a process with all of V8 says, and one for formulas only."""
    return {kind: _run(kind) for kind in ("all", "formulas")}


def _run(kind: str) -> dict[str, object]:
    texts = json.dumps(FORMULAS)
    done = subprocess.run(
        [sys.executable, "-c", CODE, kind],
        input=texts,
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=300,
        check=True,
    )
    assert done.stderr == ""
    answer: dict[str, object] = json.loads(done.stdout)
    return answer


def test_formulas_are_the_same_without_tables_of_languages(
    found: dict[str, dict[str, object]],
) -> None:
    assert found["formulas"]["made"] == found["all"]["made"]
    assert found["all"]["intl"] == "1.234,5"
    assert found["formulas"]["intl"] == ""


@pytest.mark.skipif(not SMAPS.exists(), reason="the kernel does not say")
def test_a_process_for_formulas_takes_less_memory(found: dict[str, dict[str, object]]) -> None:
    sizes = [found[kind]["sizes"] for kind in ("formulas", "all")]
    less, more = (one["Private_Dirty"] for one in sizes if isinstance(one, dict))
    assert less < more - (8 << 10)


@pytest.mark.skipif(not SMAPS.exists(), reason="the kernel does not say")
def test_names_of_the_library_take_no_memory_once_it_is_loaded() -> None:
    code = """
from pathlib import Path
from coursebuild.effects import v8_start
v8_start.preload()
held = 0
name = ""
for line in Path("/proc/self/smaps").read_text().splitlines():
    if "-" in line.split()[0]:
        name = line
    elif line.startswith("Rss:") and "libmini_racer" in name:
        held += int(line.split()[1])
print(held)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert 0 < int(done.stdout) < 6 << 10
