"""Other engines: rows of those that work, refuse, fail, crash and hang."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import pytest

from mjbench.bench import read_subject
from mjbench.engines.engine_run import (
    ChosenEngine,
    UnknownEngineError,
    chosen_engines,
    measure_engines,
)
from mjbench.host import LocalHost
from mjbench.reports.model_report import EngineRow
from samples.fake_engines import ENGINES as FAKE_ENGINES

FAKES = ("samples.fake_engines",)
BOX = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body><joint axis="0 1 0"/><geom size="0.1" pos="0 0 -1"/></body>
  </worldbody>
</mujoco>
"""
TOML = '[[scenario]]\nname = "swing"\nduration = 0.2\nsample = 0.02\nqvel = [1.0]\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "box.xml").write_text(BOX)
    (tmp_path / "box.toml").write_text(TOML)
    return tmp_path


def choose(names: Sequence[str]) -> tuple[ChosenEngine, ...]:
    return chosen_engines(names, FAKES)[0]


def measure(
    folder: Path, engines: tuple[ChosenEngine, ...], seconds: float = 900.0
) -> dict[str, EngineRow]:
    host = LocalHost(folder, lambda text: None)
    subject = read_subject(folder / "box.xml")
    report = measure_engines(subject, engines, host, quick=True, seconds=seconds)
    return {row.engine: row for row in report.scenarios[0].rows}


def rows(folder: Path, *names: str, seconds: float = 900.0) -> dict[str, EngineRow]:
    return measure(folder, choose(names), seconds)


@pytest.mark.long
def test_each_engine_has_a_row_whatever_it_does(folder: Path) -> None:
    names = ("single", "wild", "alone", "picky", "broken", "crash", "driverless")
    found_rows = rows(folder, *names)
    assert tuple(found_rows) == names
    messages = {name: (row.status, row.message) for name, row in found_rows.items()}
    long = messages.pop("broken")
    assert messages == {
        "single": ("ok", ""),
        "wild": ("diverged", "the state is not finite"),
        "alone": ("ok", ""),
        "picky": ("unsupported", "NotImplementedError: hinges are not implemented"),
        "crash": ("failed", "its process ended with status 7"),
        "driverless": ("failed", "ImportError: no driver"),
    }
    assert long[0] == "failed" and long[1].startswith("ValueError: what what")
    assert len(long[1]) == 300
    single, alone = found_rows["single"], found_rows["alone"]
    assert single.bits == 32 and single.versions[0][0] == "mujoco"
    assert single.position is not None and 0 < single.position[0] < 0.01
    assert single.apart is not None and 1e-12 < single.apart < 1e-5, "rounding, and nothing else"
    assert single.energy_drift is not None and abs(single.energy_drift) < 0.1
    assert [cost.worlds for cost in single.costs] == [1, 64]
    for cost in single.costs:
        assert cost.seconds is not None and cost.seconds.low <= cost.seconds.value
        assert cost.ratio is not None and cost.ratio.value > 0 and cost.compile_seconds is not None
    assert alone.apart == single.apart
    assert [cost.remark for cost in alone.costs] == ["", "its process ended with status 3"]


@pytest.mark.long
def test_an_engine_that_hangs_costs_its_row_only(folder: Path) -> None:
    """The limit is shorter than a process takes to start; where it strikes makes no difference."""
    row = rows(folder, "hang", seconds=2.0)["hang"]
    assert (row.status, row.message) == ("failed", "its process took longer than 2 s")


def test_engines_are_chosen_by_name() -> None:
    names = [engine.name for engine in choose(("crash", "single", "crash"))]
    assert names == ["crash", "single"]
    with pytest.raises(UnknownEngineError, match="there is no engine `singel`: known are single, "):
        choose(("singel",))
    absence = r"Absent is not installed: `pip install 'mjbench\[engines\]'` brings it"
    with pytest.raises(UnknownEngineError, match=absence):
        choose(("absent",))
    installed, remarks = chosen_engines((), FAKES)
    assert [engine.name for engine in installed] == [n for n in FAKE_ENGINES if n != "absent"]
    assert remarks == ("Absent is not installed: `pip install 'mjbench[engines]'` brings it",)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mjx", "warp"])
def test_a_real_engine_follows_mujoco(folder: Path, name: str) -> None:
    module = {"mjx": "mujoco.mjx", "warp": "mujoco_warp"}[name]
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed: `pip install 'mjbench[engines]'`")
    for row in measure(folder, chosen_engines((name,))[0]).values():
        assert row.status == "ok", row.message
        assert row.apart is not None and row.apart < (1e-4 if row.bits == 32 else 1e-12)
        assert all(cost.seconds is not None for cost in row.costs), row.costs
