"""Figures of scripts: drawn, recorded by `update`, compared by `check`, shown by `build`."""

from __future__ import annotations

import pytest

from support.scratch_course import Make, block

pytestmark = pytest.mark.site

LINE = """from pathlib import Path

with open("line.svg", "w") as file:
    file.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">')
    file.write('<path d="M0 0L{end} 9"/></svg>')
print("drawn", len(Path("line.svg").read_text()) > 9)
"""


def drawing(path: str, end: float) -> str:
    return block(path, LINE.format(end=end), "drawn True", info="figure=line.svg")


def lesson(end: float) -> str:
    return f"## A line\n\n{drawing('line.py', end)}Figure: ![A line](line.svg) It *rises*.\n"


def test_figure_is_recorded_compared_and_shown(make: Make) -> None:
    folder = make(lesson(9))
    first = folder.main("check")
    assert first.status == 1
    assert "figure-drift]: no figure of `examples/line.py` is recorded yet" in first.out
    update = folder.main("update")
    assert update.status == 0, update.out
    assert "drew content/lessons/line.svg" in update.out
    assert not (folder.root / "line.svg").exists()
    assert folder.main("check").status == 0
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.1-one.html")
    assert 'alt="A line"' in page
    assert "It <em>rises</em>." in page
    assert '<a href="#line.py">Drawn by examples/line.py</a>' in page
    assert page.count('<details class="fold" data-fold>') == 1
    folder.write(folder.lesson(), lesson(5))
    drifted = folder.main("check")
    assert "figure-drift]: the recorded figure differs from this run: 1 of its parts moved" in (
        drifted.out
    )
    assert folder.main("update", "--dry-run").out.count("would draw content/lessons/line.svg") == 1
    assert folder.main("check").status == 1
    assert folder.main("update").status == 0
    assert folder.main("check").status == 0
    folder.replace("content/lessons/line.svg", "L5 9", "L4 9")
    output = folder.main("check").out  # with a remembered run
    assert "cached" in output and "the recorded figure differs from this run" in output


def test_data_are_recorded_and_linked(make: Make) -> None:
    code = LINE.format(end=9) + 'with open("line.csv", "w") as file:\n    file.write("x\\n9\\n")\n'
    lesson = block("line.py", code, "drawn True", info="figure=line.csv,line.svg")
    text = f"## A line\n\n{lesson}Figure: A line that rises.\n"
    folder = make(text)
    update = folder.main("update")
    assert update.status == 0, update.out
    assert folder.text("content/lessons/line.csv") == "x\n9\n"
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.1-one.html")
    assert '<a href="../files/lessons/line.csv" download>Data</a>' in page
    folder.write(folder.lesson(), text.replace("9\\n", "7\\n"))
    assert "figure-drift]: the recorded data differ from this run: 1 of its cells" in (
        folder.main("check").out
    )


def test_figure_of_a_run_that_the_course_keeps_stays_as_it_was(make: Make) -> None:
    once = block("line.py", LINE.format(end=9), "drawn True", info="figure=line.svg record=once")
    folder = make(f"## A line\n\n{once}Figure: ![A line](line.svg)\n")
    assert folder.main("update", "--long").status == 0
    assert folder.main("check").status == 0


def test_scripts_that_draw_under_one_name_do_not_meet(make: Make) -> None:
    second = drawing("other.py", 3)
    folder = make(lesson(9), f"## Other\n\n{second}Figure: ![Another](other/line.svg)\n")
    folder.write("line.svg", "the author's own")
    assert folder.main("update").status == 0
    assert folder.main("check").status == 0
    assert "L9 9" in folder.text("content/lessons/line.svg")
    assert "L3 9" in folder.text("content/lessons/other/line.svg")
    assert folder.text("line.svg") == "the author's own"
