"""Extracted files as learners run them, and diverged simulations, through the commands."""

from __future__ import annotations

import json

import pytest

from support.scratch_course import Make, block

pytestmark = pytest.mark.site


# --- diverged simulations

MODEL = """
<mujoco model="cart">
  <worldbody><body><joint type="slide" axis="1 0 0"/><geom size="1" mass="1"/></body></worldbody>
</mujoco>
"""
DIVERGING_SCRIPT = f"""
import mujoco

model = mujoco.MjModel.from_xml_string('''{MODEL}''')
data = mujoco.MjData(model)
data.qfrc_applied[0] = 1e15
mujoco.mj_step(model, data)
print("error", data.qpos[0])
"""


def test_lost_simulation_fails_every_command_unless_its_lesson_says_so(make: Make) -> None:
    def lesson(force: str, info: str = "", output: str = "error 0.0") -> str:
        return "## One\n\n" + block(
            "a.py", DIVERGING_SCRIPT.replace("1e15", force), output, info=info
        )

    def rules() -> list[str]:
        report = json.loads(folder.main("check", "--format", "json").out)
        return [diagnostic["rule"] for diagnostic in report["diagnostics"]]

    folder = make(lesson("1e15"))
    first, again = folder.main("check"), folder.main("check")
    assert (first.status, again.status, "cached" in again.out) == (1, 1, True)
    assert "MuJoCo warned of bad accelerations of model `cart` at t = 0.0000 s" in first.out
    assert "diverged examples/a.py" in first.out
    assert first.out.split("\n\n")[0] == again.out.split("\n\n")[0]
    report = json.loads(folder.main("check", "--format", "json").out)
    assert [script["status"] for script in report["scripts"]] == ["diverged"]
    assert '<failure type="diverged"' in folder.main("check", "--format", "junit").out
    assert folder.main("build").status == 1
    assert not (folder.root / "public").exists()
    assert not list(folder.root.rglob("MUJOCO_LOG*"))
    folder.write(folder.lesson(), lesson("1e15", output="error 1.0"))
    result = folder.main("update")
    assert (result.status, "error[script-diverged]" in result.out) == (1, True)
    for text, expected in (
        (lesson("1e15"), ["script-diverged"]),
        (lesson("1e15", "diverges"), []),  # from the store
        (lesson("0.0", "diverges"), ["script-stable"]),
        (lesson("0.0"), []),
    ):
        folder.write(folder.lesson(), text)
        assert rules() == expected
