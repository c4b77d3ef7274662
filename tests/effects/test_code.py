"""Which code measured something."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.effects import code


def test_content_counts_and_times_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(code, "_PACKAGE", tmp_path)
    (tmp_path / "part" / "inner").mkdir(parents=True)
    module, other = tmp_path / "part" / "inner" / "a.py", tmp_path / "other.py"
    module.write_text("x = 1\n")
    other.write_text("y = 1\n")
    first = code.code_digest("part")
    module.touch()
    other.write_text("y = 2\n")
    assert code.code_digest("part") == first
    both = code.code_digest("part", "other.py")
    other.write_text("y = 3\n")
    assert code.code_digest("part", "other.py") != both
    module.rename(tmp_path / "part" / "a.py")
    assert code.code_digest("part") != first


def test_a_part_that_is_not_there_is_a_bug(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(code, "_PACKAGE", tmp_path)
    with pytest.raises(FileNotFoundError):
        code.code_digest("missing")
