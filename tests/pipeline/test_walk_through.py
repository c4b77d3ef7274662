"""A lesson that walks through its code: parts of one script, which runs once."""

from __future__ import annotations

import io
import json
import re
import zipfile

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Make

pytestmark = pytest.mark.site

PATH = "examples/heat.py"
LESSON = fixture_text("documents/heat.md")
FILE = fixture_text("scripts/heat.txt")


def test_outputs_are_those_of_their_parts_and_everything_else_has_the_whole_file(
    make: Make,
) -> None:
    folder = make(LESSON.replace("#L16-L17", "#L12-L14").replace("\n", "\r\n"))
    result = folder.main("update").require_success()
    assert "1 script run" in result.out and folder.text(PATH) == FILE
    text = folder.text(folder.lesson())
    assert "\n" not in text.replace("\r\n", "")
    plain = text.replace("\r\n", "\n")
    for output in ("sum 1.0\ncells: 5", "   max 0.3125", "checked True"):
        assert f"```output\n{output}\n" in plain or f"```text\n{output}\n" in plain, output
    assert "#step\ndef step(u):\n    inner" in plain
    assert "#L12-L14\nfor _ in range(3):\n    rod = step(rod)\nprint" in plain
    assert folder.main("check").status == 0
    folder.main("build").require_success()
    page = folder.text("public/lessons/1.1-one.html")
    figures = re.findall(r"<figure [^>]*data-script=.*?</figure>", page, re.DOTALL)
    bare = [re.sub(r"<[^>]*>", "", figure).replace("&quot;", '"') for figure in figures]
    assert ["cells: 5" in text for text in bare] == [True, False, False, False, False]
    assert ["max 0.3125" in text for text in bare] == [False, False, True, False, False]
    assert ["rod == rod" in text for text in bare] == [False, False, False, True, False]
    assert ["checked True" in text for text in bare] == [False, False, False, False, True]
    assert ["<details" in figure for figure in figures] == [False, True, False, False, False]
    assert ["download>" in figure for figure in figures] == [True, False, False, False, False]
    assert ["python heat.py" in text for text in bare] == [True] + [False] * 4
    assert f'<div hidden="until-found">{figures[3]}' in page and page.count("until-found") == 1
    assert all(page.count(f'id="heat.L{line}"') == 1 for line in (1, 5, 7, 9, 12, 14, 16))
    assert folder.main("export", "epub").status == 0
    book = zipfile.ZipFile(io.BytesIO(folder.read("course.epub")))
    text = book.read("EPUB/1.1-one.xhtml").decode()
    assert "hidden" not in text and all(f'id="heat.L{line}"' in text for line in (1, 9, 16))
    archive = zipfile.ZipFile(io.BytesIO(folder.read("public/lessons/1.1-one.zip")))
    (name,) = [name for name in archive.namelist() if name.endswith("heat.py")]
    assert archive.read(name) == FILE.encode()
    assert folder.text("public/examples/heat.py").endswith(f"dependencies = []\n# ///\n{FILE}")
    cells = json.loads(folder.read("public/lessons/1.1-one.ipynb"))["cells"]
    scripts = ["".join(c["source"]) for c in cells if c["id"].startswith("code-")]
    assert scripts == [f"%%example examples/heat.py\n{FILE.rstrip()}"]


WRONG_SECOND_PARTS = {
    "raise ValueError(rod)": "error[script-failed]: `examples/heat.py` exited with status 1",
    "while True: pass": "error[script-timeout]: `examples/heat.py` was stopped after 1 s",
}


def test_a_mistake_in_a_part_stands_at_its_line_of_the_lesson(make: Make) -> None:
    head = "## Heat\n\n```python file=examples/heat.py timeout=1\nprint('a')\nrod = 1\n```\n\n"
    head += (
        "```output\na\n```\n\nText between.\n\n> ```python file=examples/heat.py part\n> # why\n> "
    )
    folder = make("")
    for code, message in WRONG_SECOND_PARTS.items():
        folder.write(folder.lesson(), f"{head}{code}\n> ```\n")
        result = folder.main("check")
        line = head.count("\n") + 1
        assert result.status == 1 and message in result.out, result.out
        assert f"--> content/lessons/1.1-one.md:{line}:3\n" in result.out, result.out


SILENT = fixture_text("documents/heat_parts.md")


def test_an_output_is_compared_with_its_own_part(make: Make) -> None:
    folder = make(SILENT)
    result = folder.main("check")
    assert result.status == 1 and result.out.count("error[") == 2, result.out
    assert "here, but this part of `examples/x.py` printed nothing" in result.out
    assert "1.1-one.md:24:1\n    |\n 24 | 3\n    | ^ this run printed 2" in result.out


def test_an_edited_file_goes_back_into_its_parts(make: Make) -> None:
    folder = make(LESSON.partition("Once more")[0])
    assert folder.main("update").status == 0
    text, code = folder.text(folder.lesson()), folder.text(PATH)
    folder.write(PATH, code.replace("0.25 *", "0.5 *").replace('"max"', '"largest"'))
    folder.main("extract", "--adopt").require_success()
    changed = text.replace(">     return [u[0], *(b + 0.25", ">     return [u[0], *(b + 0.5")
    assert folder.text(folder.lesson()) == changed.replace('   print("max"', '   print("largest"')
    assert "every script is extracted already" in folder.main("extract", "--adopt").out
    text, code = folder.text(folder.lesson()), folder.text(PATH)
    folder.write(PATH, code.replace("sum(rod))\n\ndef", "sum(rod))\ndef").replace("largest", "max"))
    assert folder.main("extract", "--adopt").status == 0
    assert folder.text(folder.lesson()) == text.replace("largest", "max")
    assert folder.text(PATH) == code.replace("largest", "max")
    crossing_code = code.replace(
        'print("sum", sum(rod))\n\ndef step', "print(rod)\nx = 1\ndef leap"
    )
    folder.write(PATH, crossing_code)
    result = folder.main("extract", "--adopt")
    assert result.status == 1 and "a change goes from one of its parts into the next" in result.out
    assert folder.text(PATH) == crossing_code
