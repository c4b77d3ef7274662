"""A script whose simulation is lost fails the check, whichever way it is run or remembered."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from support.scratch_course import Folder, block

pytestmark = pytest.mark.site

Make = Callable[..., Folder]

MODEL = """
<mujoco model="cart">
  <worldbody><body><joint type="slide" axis="1 0 0"/><geom size="1" mass="1"/></body></worldbody>
</mujoco>
"""
LOST = f"""
import mujoco

model = mujoco.MjModel.from_xml_string('''{MODEL}''')
data = mujoco.MjData(model)
data.qfrc_applied[0] = 1e15
mujoco.mj_step(model, data)
print("error", data.qpos[0])
"""
SOUND = LOST.replace("1e15", "0.0")
OUTPUT = "error 0.0"


def lesson(code: str, info: str = "") -> str:
    return "## One\n\n" + block("a.py", code, OUTPUT, info=info)


def rules(folder: Folder, *arguments: str) -> list[str]:
    done = folder.main("check", "--format", "json", *arguments)
    return [each["rule"] for each in json.loads(done.out)["diagnostics"]]


def test_check_fails_where_mujoco_reset_a_lost_simulation(make: Make) -> None:
    folder = make(lesson(LOST))
    done = folder.main("check")
    assert done.status == 1
    assert "MuJoCo warned of bad accelerations of model `cart` at t = 0.0000 s" in done.out
    assert "diverged examples/a.py" in done.out


def test_remembered_divergence_fails_again(make: Make) -> None:
    folder = make(lesson(LOST))
    first = folder.main("check")
    again = folder.main("check")
    assert "cached" in again.out
    assert again.status == 1
    assert first.out.split("\n\n")[0] == again.out.split("\n\n")[0]


def test_divergence_is_not_published(make: Make) -> None:
    folder = make(lesson(LOST))
    assert folder.main("build").status == 1
    assert not (folder.root / "public").exists()


def test_update_tells_divergence(make: Make) -> None:
    folder = make(lesson(LOST).replace(OUTPUT, "error 1.0"))
    done = folder.main("update")
    assert done.status == 1
    assert "error[script-diverged]" in done.out


def test_script_that_says_it_diverges_may(make: Make) -> None:
    assert rules(make(lesson(LOST, "diverges"))) == []


def test_script_that_says_it_diverges_and_does_not_is_told(make: Make) -> None:
    assert rules(make(lesson(SOUND, "diverges"))) == ["script-stable"]


def test_sound_script_is_not_remarked_on(make: Make) -> None:
    assert rules(make(lesson(SOUND))) == []


def test_saying_diverges_counts_for_a_remembered_run(make: Make) -> None:
    folder = make(lesson(LOST))
    assert rules(folder) == ["script-diverged"]
    folder.replace(folder.lesson(), "file=examples/a.py", "file=examples/a.py diverges")
    assert rules(folder) == []


def test_json_and_junit_tell_divergence(make: Make) -> None:
    folder = make(lesson(LOST))
    report = json.loads(folder.main("check", "--format", "json").out)
    assert [script["status"] for script in report["scripts"]] == ["diverged"]
    assert '<failure type="diverged"' in folder.main("check", "--format", "junit").out


def test_block_without_file_cannot_say_diverges(make: Make) -> None:
    folder = make("## One\n\n```python diverges\nx = 1\n```\n\n" + block("b.py", "print(1)"))
    assert rules(folder) == ["fence-key-value"]


def test_no_log_is_left_in_the_course(make: Make) -> None:
    folder = make(lesson(LOST))
    folder.main("check")
    assert not list(folder.root.rglob("MUJOCO_LOG*"))
