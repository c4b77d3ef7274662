"""What `builds.py` is asked for is measured, or refused."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks import builds


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ("--parts=builds,memory", "there is no part `memory`: name some of builds, serve, scripts"),
        ("--tools=coursebuild,jekyll", "no tool is called jekyll: there are coursebuild, "),
    ],
)
def test_an_unknown_part_or_tool_is_refused(
    option: str, says: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["builds.py", option])
    with pytest.raises(SystemExit) as stop:
        builds.main()
    printed = capsys.readouterr()
    assert stop.value.code, "not the status of success"
    assert says in f"{stop.value.code} {printed.err}"
    assert printed.out == ""
