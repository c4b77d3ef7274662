"""A short pass of every target of `make fuzz`, the same each time."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("atheris", reason="there is none for this system")

from fuzz.__main__ import main
from fuzz.targets import TARGETS


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_nothing_is_found(target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main([target, "--runs", "1000", "--seed", "21", "--out", str(tmp_path)])
    assert status == 0, capsys.readouterr().out
