"""`coursebuild import --prove`: what running shows, and what becomes of cells that cannot run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from coursebuild.cli import main

ABSENT = "a_package_that_nobody_has"


def write_notebook(path: Path, *codes: str, printed: str = "") -> None:
    stream = [{"output_type": "stream", "name": "stdout", "text": printed}] if printed else []
    cells = [{"cell_type": "code", "source": code, "outputs": stream} for code in codes]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4}))


def files_of(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and ".coursebuild" not in path.parts
    }


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_nothing_runs_before_it_is_asked_for(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_notebook(folder / "old/a.ipynb", "open('ran', 'w').close()", printed="as recorded\n")
    assert main(["import", "old", "--out", "new"]) == 0
    assert "1 script not run: run `coursebuild -C new import --prove`" in capsys.readouterr().out
    assert "```output\nas recorded\n```" in lesson(folder / "new", "1.1-a")
    assert not list(folder.rglob("ran"))


def lesson(course: Path, name: str) -> str:
    return (course / "content" / "lessons" / f"{name}.md").read_text()


def test_a_missing_module_costs_the_cells_that_use_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_notebook(
        folder / "old/a.ipynb",
        f"import math\nimport {ABSENT} as absent",
        "print(round(math.pi, 3))",
        "value = absent.compute()",
        "print(value)",
        "value = 2",
        "print('value', value)",
    )
    assert main(["import", "old", "--out", "new"]) == 0
    assert main(["-C", "new", "import", "--prove"]) == 0
    text = lesson(folder / "new", "1.1-a")
    head = "python file=examples/l1_1_a.py"
    assert f"```{head}\nimport math\n```" in text
    assert f"```{head} part\nprint(round(math.pi, 3))\n```\n\n```output\n3.142\n```" in text
    reason = f"*Not run here:* `ModuleNotFoundError: No module named '{ABSENT}'`"
    assert f"```python\nimport {ABSENT} as absent\n```\n\n{reason}\n" in text
    assert "```python\nvalue = absent.compute()\n```\n\n*Not run here:* it needs `absent`" in text
    assert "```python\nprint(value)\n```\n\n*Not run here:* it needs `value`" in text
    assert f"```{head} part\nvalue = 2\n```" in text
    assert "```output\nvalue 2\n```" in text
    assert "2 cells shown, not run" in (folder / "new" / "IMPORT.md").read_text()
    assert "everything holds" in capsys.readouterr().out


def test_a_cell_that_fails_costs_only_those_that_need_it(folder: Path) -> None:
    plot = "import matplotlib.pyplot as plt\nplt.plot([1, 2])\nplt.title('A line')\n"
    write_notebook(
        folder / "old/a.ipynb",
        "import matplotlib.pyplot as plt\nplt.plot([3])\nheight = 1 / 0",
        "print(height)",
        plot + "plt.show()",
        "print(missing)",
        "print('at the end')",
    )
    write_notebook(folder / "old/b.ipynb", "1 / 0")
    write_notebook(folder / "old/c.ipynb", f"import {ABSENT}", f"{ABSENT}.run()")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    text = lesson(folder / "new", "1.1-a")
    names = ["l1-1-a-1.svg", "l1-1-a-2.svg"]
    assert names[0] not in text
    assert f"```python file=examples/l1_1_a.py figure={names[1]}\n{plot}" in text
    assert f"Figure: ![A line]({names[1]}) A line" in text
    assert (folder / "new/content/lessons" / names[1]).read_bytes().startswith(b"<")
    assert "height = 1 / 0\n```\n\n*Not run here:* `ZeroDivisionError: division by zero`" in text
    assert "print(height)\n```\n\n*Not run here:* it needs `height`" in text
    assert "*Not run here:* `NameError: name 'missing' is not defined`" in text
    assert "```output\nat the end\n```" in text
    assert lesson(folder / "new", "1.2-b").startswith(
        "```python\n1 / 0\n```\n\n*Not run here:* `Zero"
    )
    assert lesson(folder / "new", "1.3-c").startswith(
        f"```python file=examples/l1_3_c.py requires={ABSENT}\n"
    )


def test_what_a_notebook_recorded_is_replaced_unless_somebody_edited_it(folder: Path) -> None:
    for name in "ab":
        write_notebook(folder / f"old/{name}.ipynb", "print('mass', 4.79)", printed="mass 3\n")
    assert main(["import", "old", "--out", "new"]) == 0
    lesson_path = folder / "new/content/lessons/1.2-b.md"
    lesson_path.write_text(lesson_path.read_text().replace("mass 3", "mass 5"))
    assert main(["-C", "new", "import", "--prove"]) == 1
    assert "```output\nmass 4.79\n```" in lesson(folder / "new", "1.1-a")
    assert "```output\nmass 5\n```" in lesson_path.read_text()
    account = (folder / "new/IMPORT.md").read_text()
    assert "1.1-a.md: the recorded output does not hold here" in account
    before = files_of(folder / "new")
    assert main(["-C", "new", "import", "--prove"]) == 1
    assert files_of(folder / "new") == before


def test_a_script_gets_the_folder_that_it_writes_to(folder: Path) -> None:
    code = "import os\nos.makedirs('runs', exist_ok=True)\nopen('runs/a.txt', 'w').write('x')"
    write_notebook(folder / "old/a.ipynb", f"{code};")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    assert " writes=runs/\n" in lesson(folder / "new", "1.1-a")
