"""Courses of strangers: `--sandbox` in all commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.sandboxes import require_sandbox
from support.scratch_course import GOOD, Make, block

pytestmark = pytest.mark.site
WRITES = "from pathlib import Path\nPath('new').write_text('x')\nprint(1)"


def test_results_count_in_the_sandbox_and_outside(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", "print(1)", "1"))
    require_sandbox(folder.root)
    first = folder.main("check", "--sandbox", "-v")
    assert first.status == 0 and "running scripts (1)" in first.err, first
    assert "running scripts" not in folder.main("build").err
    folder.replace(folder.lesson(), "print(1)", "print( 1)")
    assert "running scripts (1)" in folder.main("check").err
    assert "running scripts" not in folder.main("build", "--sandbox").err


def test_what_a_script_changes_is_told_and_in_the_sandbox_does_not_happen(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", WRITES, "1"))
    require_sandbox(folder.root)
    inside = folder.main("check", "--sandbox")
    assert inside.status == 1 and "Read-only file system" in inside.out
    assert not (folder.root / "new").exists()
    outside = folder.main("check")
    assert outside.status == 0 and (folder.root / "new").exists()
    for result in (inside, outside):
        assert "warning[script-writes]: `examples/a.py` writes outside its" in result.out
        assert f"--> {folder.lesson()}:5:1" in result.out


def test_code_that_the_tool_would_run_is_refused(make: Make) -> None:
    folder = make(GOOD)
    require_sandbox(folder.root)
    map = folder.text("content/course.toml")
    folder.write("features/evil.py", "open('evil', 'w')\n")
    with_feature = map.replace("[course]\n", '[course]\nfeatures = ["features/evil.py"]\n')
    folder.write("content/course.toml", with_feature)
    result = folder.main("check", "--sandbox")
    assert (result.status, result.out) == (1, "")
    assert "`features/evil.py` is code that the tool would run" in result.err
    assert not (folder.root / "evil").exists()
    folder.write("content/course.toml", map)
    folder.write("theme/templates/page.html", "{{ 1 }}")
    result = folder.main("build", "--sandbox")
    assert result.status == 1 and "`theme/templates/` is code" in result.err


def test_nothing_runs_without_a_sandbox(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make(GOOD)
    monkeypatch.setenv("PATH", str(tmp_path))
    result = folder.main("check", "--sandbox")
    assert (result.status, result.out) == (1, "")
    assert result.err == (
        "coursebuild: `--sandbox` needs Bubblewrap, but there is no program `bwrap`\n"
        "  help: install it, as by `apt-get install bubblewrap`\n"
    )
    assert not (folder.root / "examples").exists()
