"""Plots as files: one for each scenario, under names that differ."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.features.bench.commands.bench.run import plot_file, write_plots
from coursebuild.pipeline.options import UsageError
from support.bench_reports import lost, scenario, scene, swing


def test_one_scenario_goes_into_the_file_that_was_named(tmp_path: Path) -> None:
    file = tmp_path / "plot.svg"
    assert write_plots(file, [scene()]) == ("wrote plot.svg",)
    first = file.read_bytes()
    assert first.startswith(b'<svg xmlns="http://www.w3.org/2000/svg"')
    assert write_plots(file, [scene()]) == ("wrote plot.svg",)
    assert file.read_bytes() == first
    assert [path.name for path in tmp_path.iterdir()] == ["plot.svg"]


def test_several_scenarios_go_into_files_of_their_own(tmp_path: Path) -> None:
    scenes = [
        scene(swing(), replace(swing(), name="Sprung ö/ä"), model="arms/left"),
        scene(swing(), model="arms left"),
        scene(scenario([lost()], name="gone"), model="leg"),
    ]
    assert write_plots(tmp_path / "a.SVG", scenes) == (
        "wrote a-arms-left-swing.SVG",
        "wrote a-arms-left-Sprung-ö-ä.SVG",
        "wrote a-arms-left-swing-2.SVG",
        "leg, gone: there is no error to draw",
    )
    assert len(list(tmp_path.iterdir())) == 3


def test_where_it_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"--plot: 'a\.png' is no name"):
        plot_file("a.png")
    with pytest.raises(UsageError, match=r"--plot: there is no folder .*/no"):
        plot_file(str(tmp_path / "no" / "a.svg"))
    (tmp_path / "a.svg").mkdir()
    with pytest.raises(UsageError, match=r"--plot: .*a.svg cannot be written: is a directory"):
        write_plots(tmp_path / "a.svg", [scene()])
    assert plot_file(str(tmp_path / "b.svg")) == tmp_path / "b.svg"
