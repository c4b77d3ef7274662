"""`check --sensitivity`: digits that repeat, and digits that are converged."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder, Make, block

pytestmark = pytest.mark.long

DOUBLE_PENDULUM = fixture_text("scripts/double_pendulum.txt")
FALL = fixture_text("scripts/fall.txt")
SWING = fixture_text("scripts/swing.txt")
TIMES = fixture_text("scripts/times.txt")
LIMIT = fixture_text("scripts/limit.txt")
PLAIN = "print('nothing moves', 1.5)\n"


def measure(folder: Folder, *arguments: str) -> dict[str, Any]:
    report = json.loads(folder.main("check", "--sensitivity", "--format", "json", *arguments).out)
    assert report["summary"]["errors"] == 0, report["diagnostics"]
    return {script["path"]: script for script in report["sensitivity"]} | {
        "noise": sorted(
            re.findall(r"examples/\w+\.py", d["message"])[0] for d in noise_warnings(report)
        )
    }


def noise_warnings(report: dict[str, Any]) -> list[dict[str, Any]]:
    """The warnings of noise in a report that has no other diagnostics."""
    assert {diagnostic["rule"] for diagnostic in report["diagnostics"]} <= {"output-noise"}
    diagnostics: list[dict[str, Any]] = report["diagnostics"]
    return diagnostics


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course with all of the scripts, whose sensitivity was measured once."""
    folder = Folder(tmp_path_factory.mktemp("sensitivity") / "course")
    scripts = [("double", DOUBLE_PENDULUM), ("fall", FALL), ("limit", LIMIT), ("plain", PLAIN)]
    scripts += [("times", TIMES)]
    scripts += [(name, SWING.replace("INTEGRATOR", name)) for name in ("Euler", "RK4")]
    blocks = [block(f"{name}.py", code, "?") for name, code in scripts]
    blocks.append(block("loose.py", DOUBLE_PENDULUM, "?", "rtol=1e-9 atol=29"))
    folder.fill(["## One\n\n" + "".join(blocks)], stores)
    folder.main("update", "--quiet")
    return folder


@pytest.fixture(scope="module")
def by_path(course: Folder) -> dict[str, Any]:
    return measure(course)


def test_double_pendulum_is_chaotic_and_keeps_its_first_digits(
    course: Folder, by_path: dict[str, Any]
) -> None:
    script = by_path["examples/double.py"]
    assert script["chaotic"]
    assert script["amplification"] > 1e10
    assert script["numbers"] == 8
    lines = course.text(course.lesson()).splitlines()
    first = next(i for i, line in enumerate(lines, 1) if line.startswith("t 1.0 "))
    doubted = {
        (doubt["line"] - first, doubt["column"]): doubt["repeat"] for doubt in script["doubts"]
    }
    rows = {line for line, _ in doubted}
    assert 0 not in rows, "after a second all holds"
    assert set(doubted.values()) <= {0, 1}
    assert (1, 3) not in doubted, "the time is exact"
    assert (1, 8) in doubted, "after thirty seconds nothing holds"
    assert 3 not in rows, "the number of joints is exact"


def test_what_holds_and_what_does_not(course: Folder, by_path: dict[str, Any]) -> None:
    script = by_path["examples/fall.py"]
    assert (script["status"], script["chaotic"]) == ("measured", False)
    assert all(doubt["repeat"] == doubt["digits"] for doubt in script["doubts"])
    assert script["amplification"] < 1e4
    assert script["numbers"] == 3
    [flip] = by_path["examples/limit.py"]["flips"]  # other words are printed near a threshold
    assert (flip["printed"], flip["other"]) == ("", "left or")
    doubts = by_path["examples/loose.py"]["doubts"]
    assert doubts and not any(doubt["compared"] for doubt in doubts)
    assert "(allowed for)" in course.main("check", "--sensitivity").out
    # Only digits that are compared and do not repeat lead to warnings.
    assert by_path["noise"] == ["examples/double.py", "examples/limit.py"]
    for form in ("junit", "sarif", "github"):
        assert "output-noise" in course.main("check", "--sensitivity", "--format", form).out, form
    report = json.loads(course.main("check", "--format", "json").out)
    assert ("sensitivity" in report, report["diagnostics"]) == (False, [])


def test_digits_that_are_converged_are_right(course: Folder, by_path: dict[str, Any]) -> None:
    exact = 0.9723658841  # rad, by Jacobi's elliptic functions
    for name, least in (("Euler", 1), ("RK4", 4)):
        # The count and the timestep are those of the whole run.
        [doubt] = by_path[f"examples/{name}.py"]["doubts"]
        assert doubt["repeat"] == doubt["digits"], "all runs print the same"
        assert doubt["printed"] != f"{exact:.7f}", "which is not right"
        assert least <= doubt["converged"] < doubt["digits"], name
        decimals = len(doubt["instead"].partition(".")[2])
        assert abs(float(doubt["instead"]) - exact) < 10**-decimals, name


def test_times_looked_for_at_every_step_are_known_to_a_step(by_path: dict[str, Any]) -> None:
    """Exact is 1.16549 s, by an elliptic integral, which shorter steps within those do not show.

    Neither the time of the end nor the state there is looked for.
    """
    doubts = by_path["examples/times.py"]["doubts"]
    assert [(d["printed"], d["converged"], d["instead"], d["sampled"]) for d in doubts] == [
        ("1.168", 3, "1.17", "0.004"),
        ("1.1640", 3, "1.16", "0.004"),
        ("1168", 3, "", "4"),
    ]
    assert all(d["printed"] == d["halved"] == d["quartered"] for d in doubts)


def test_report_as_text(course: Folder, by_path: dict[str, Any]) -> None:
    result = course.main("check", "--sensitivity")
    assert result.status == 0
    assert "moving initial states" not in result.err, "all is remembered"
    lines = result.out[result.out.index("digits that repeat") :].splitlines()
    assert lines[:2] == [
        "digits that repeat when initial states are moved by 1e-12 (relative), and",
        "digits that are converged: half and a quarter of the timestep bear them out",
    ]
    at = next(i for i, line in enumerate(lines) if "examples/fall.py" in line)
    head = (
        "some      examples/fall.py  of 3 numbers 3 repeat in full, 2 are converged in full, states"
    )
    assert lines[at].startswith(head)
    assert lines[at].endswith(" times as far apart as they began")
    assert re.search(
        r"of 5 digits 5 repeat, [0-4] are converged, print \S+  \(half the", lines[at + 1]
    )
    assert "not asked examples/plain.py  it does not use MuJoCo" in lines


def test_drifted_outputs_are_not_asked_and_a_warning_may_be_silenced(
    course: Folder, by_path: dict[str, Any], tmp_path: Path
) -> None:
    copy = course.duplicate(tmp_path / "copied")
    silence = '\n[[silence]]\nrule = "output-noise"\nreason = "the lesson is about borders"\n'
    copy.write("content/course.toml", copy.text("content/course.toml") + silence)
    assert measure(copy)["noise"] == []
    copy.replace(copy.lesson(), "bodies 2\n```", "bodies 3\n```")
    report = json.loads(copy.main("check", "--sensitivity", "--format", "json").out)
    status = {script["path"]: script["status"] for script in report["sensitivity"]}
    assert status["examples/fall.py"] == "drifted"


def test_only_the_lessons_that_are_named(make: Make) -> None:
    folder = make(
        "## One\n\n" + block("a.py", PLAIN, "nothing moves 1.5"),
        "## Two\n\n" + block("b.py", LIMIT, "right"),
    )
    by_script = measure(folder, "1.1")
    assert (set(by_script), by_script["noise"]) == ({"examples/a.py", "noise"}, [])


def test_runs_with_moved_states_are_remembered_beside_the_others(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", DOUBLE_PENDULUM, "?") + block("b.py", FALL, "?"))
    assert "moving initial states" not in folder.main("update").err
    before = folder.main("explain", "examples/b.py").out
    stages = ("moving initial states, 4 of 4", "halving timesteps")
    result = folder.main("check", "--sensitivity")
    assert all(stage in result.err for stage in stages)
    assert result.out.count("warning[output-noise]") == 1
    assert "`examples/a.py` prints digits that are noise" in result.out
    place = result.out[result.out.index("--> ") :].split()[1]
    line = folder.text(folder.lesson()).splitlines()[int(place.split(":")[1]) - 1]
    assert line.startswith("t 30.0 ")
    again = folder.main("check", "--sensitivity")
    assert not any(stage in again.err for stage in stages)
    assert "of 3 numbers 3 repeat in full" in again.out
    assert (
        folder.main("explain", "examples/b.py").out.split("last run")[0]
        == before.split("last run")[0]
    )
    fresh = folder.main("check", "--sensitivity", "--no-cache")
    assert all(stage in fresh.err for stage in stages)
