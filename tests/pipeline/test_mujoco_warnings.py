"""Warnings of MuJoCo, and simulations that it gives up, while a model is measured."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.cli import main
from support.measured_course import TOML, write

pytestmark = pytest.mark.site

SINGULAR = """\
<mujoco>
  <worldbody>
    <body>
      <joint axis="0 0 1"/>
      <joint axis="0 0 1"/>
      <geom size="0.1" pos="0.3 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A model of whose inertia MuJoCo warns at compilation and in each `mj_forward`."""


@pytest.mark.parametrize(
    "command",
    [
        ("bench", "--quick"),
        pytest.param(("bench", "--record"), marks=pytest.mark.slow),
        ("diet", "--quick", "--fix"),
    ],
    ids=" ".join,
)
def test_measuring_leaves_no_log_of_mujoco(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    command: tuple[str, ...],
) -> None:
    write(tmp_path / "content" / "course.toml", "")
    write(tmp_path / "models" / "box.xml", SINGULAR)
    declarations = TOML.replace("qvel = [1.0]", "qvel = [1.0, 0.0]")
    write(tmp_path / "models" / "box.toml", declarations)
    monkeypatch.chdir(tmp_path)
    assert main(command) == 0
    out, err = capfd.readouterr()
    assert "box" in out
    assert "WARNING" not in out + err
    assert not list(tmp_path.rglob("MUJOCO_LOG*"))


CROWDED_MODEL = f"""\
<mujoco>
  <size memory="10K"/>
  <worldbody>
    <geom type="plane" size="2 2 1"/>
    {'<body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>' * 9}
  </worldbody>
</mujoco>
"""
"""A model whose contacts need more memory than it sets."""


def test_bench_tells_a_model_that_mujoco_gives_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "content" / "course.toml", "")
    write(tmp_path / "models" / "box.xml", CROWDED_MODEL)
    write(tmp_path / "models" / "box.toml", TOML.replace("qvel = [1.0]\n", ""))
    assert main(["-C", str(tmp_path), "bench", "--quick"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(
        "error[model-error]: the model `box` cannot be measured: mj_stackAlloc: out of memory"
    )
    assert lines[1] == "  --> models/box.xml:1:1"
    assert not list(tmp_path.rglob("MUJOCO_LOG*"))
