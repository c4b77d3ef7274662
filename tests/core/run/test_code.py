"""Which code measured something."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.run.code import code_digest


def test_content_counts_and_times_do_not(tmp_path: Path) -> None:
    (tmp_path / "part" / "inner").mkdir(parents=True)
    module, other = tmp_path / "part" / "inner" / "a.py", tmp_path / "other.py"
    module.write_text("x = 1\n")
    other.write_text("y = 1\n")
    first = code_digest("part", root=tmp_path)
    module.touch()
    other.write_text("y = 2\n")
    assert code_digest("part", root=tmp_path) == first
    both = code_digest("part", "other.py", root=tmp_path)
    other.write_text("y = 3\n")
    assert code_digest("part", "other.py", root=tmp_path) != both
    module.rename(tmp_path / "part" / "a.py")
    assert code_digest("part", root=tmp_path) != first


def test_a_part_that_is_not_there_is_a_bug(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        code_digest("missing", root=tmp_path)
