"""Values that another tool computes for a sentence: what shows them, and that they are bound."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest

from coursebuild.cli import main
from support.fixture_cases import fixture_text

pytestmark = pytest.mark.site

TEXT = fixture_text("documents/inline_values.md")
GLUED = fixture_text("documents/glued_values.md")
RUNNER = """
import re, sys
code = re.sub(r"(\\w+) <- ", r"\\1 = ", open(sys.argv[1]).read()).replace("cat(", "print(")
exec(code, {"format": str})
"""
"""What runs the little of R that stands above."""


def lesson(name: str) -> str:
    return Path(f"new/content/lessons/{name}.md").read_text(encoding="utf-8")


def write_cells(codes: Iterable[str]) -> str:
    return "".join(f"```{{r}}\n{code}\n```\n\n" for code in codes)


def add_runner(folder: Path) -> None:
    """Let the map say what runs R."""
    course_map, runner = Path("new/content/course.toml"), folder / "runner.py"
    runner.write_text(RUNNER)
    runners = f'[runners]\nr = [["python3", "{runner}", "{{file}}"]]\n\n[[level]]'
    course_map.write_text(course_map.read_text().replace("[[level]]", runners, 1))


def test_values_in_sentences_are_bound_to_what_the_cells_above_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("old").mkdir()
    Path("old/a.qmd").write_text(TEXT)
    Path("old/b.md").write_text(GLUED)
    Path("old/c.Rmd").write_text(
        "# Three\n\n" + write_cells(("z <- 2", "z <- z + 1")) + "There are `r z`.\n"
    )
    assert main(["import", "old", "--out", "new"]) == 0
    report = capsys.readouterr().out
    assert "`{python} x`, whose value its tool shows: print it in a script, bind it" in report
    assert "left: 2 more like this: b.md, line 9; b.md, line 9\n" not in report
    text = lesson("1.1-a")
    assert "Before: `x`." in text
    assert 'print("x:", x)  # for the text\n' in text
    assert "It is `x = ?`, by `name = ?`, or `x 2 = ?`." in text
    add_runner(tmp_path)
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert "`NameError: name 'gone' is not defined`" in capsys.readouterr().out
    text = lesson("1.1-a")
    script = "examples/l1_1_a.py"
    assert f'It is `1.7142857142857142`{{out={script} "x"}}, by `Euler`{{out={script}}}' in text
    assert f'or `1.71`{{out={script} "x 2"}}.' in text
    script = "examples/l1_2_b.py"
    assert f'It is `0.33`{{out={script} "third"}}, `2.5`{{out={script} "y"}}' in lesson("1.2-b")
    assert ", `elsewhere = ?`." in lesson("1.2-b")
    assert 'There are `3`{out=examples/l1_3_c.R "z"}.' in lesson("1.3-c")
    assert "> Now it is `x 3 = ?` and `gone = ?`." in lesson("1.1-a")
    assert main(["-C", "new", "check"]) == 0


def test_cells_of_r_are_proven_up_to_the_first_that_cannot_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    cells = ("z <- 2\ncat(z)", "y <- zzz", "cat(3)")
    Path("old").mkdir()
    Path("old/a.Rmd").write_text("# One\n\n" + write_cells(cells))
    Path("old/b.Rmd").write_text("# Two\n\n" + write_cells(cells[1:]))
    assert main(["import", "old", "--out", "new"]) == 0
    add_runner(tmp_path)
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert "examples/l1_1_a.R ends before the first cell that cannot run" in capsys.readouterr().out
    reason = "*Not run here:* `NameError: name 'zzz' is not defined`"
    rest = f"```r\ny <- zzz\n```\n\n{reason}\n\n```r\ncat(3)\n```\n\n"
    rest += "*Not run here:* a cell above fails"
    head = "```r show=examples/l1_1_a.R#L1-L2\nz <- 2\ncat(z)\n```"
    script = "```r file=examples/l1_1_a.R folded\nz <- 2\ncat(z)\n```\n\n```output\n2\n```"
    assert lesson("1.1-a").strip() == f"{head}\n\n{rest}\n\n{script}"
    assert f"{rest}\n\n```r file=examples/l1_2_b.R folded norun\n" in lesson("1.2-b")
    assert main(["-C", "new", "check"]) == 0
