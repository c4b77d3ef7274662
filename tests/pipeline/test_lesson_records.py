"""What outputs and figures were recorded with: beside each lesson, in messages and on pages."""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.files.resources import template_texts
from support.fixture_cases import fixture_text
from support.preview_process import serve_preview
from support.scratch_course import GOOD, Folder, Make, block
from support.workflows import git

pytestmark = pytest.mark.site

RECORD = "content/lessons/1.1-one.recorded.txt"
NUMPY = f'["numpy","{version("numpy")}"]'
OTHER_NUMPY = '["numpy","1.26.4"]'
PYTHON = f"Python {platform.python_version()}"

ARRAY = "import numpy as np\nprint(np.arange(3.0).sum())"
DRAWING = fixture_text("scripts/drawing.txt")


def numpy_lesson(output: str = "3.0") -> str:
    return "## An array\n\n" + block("total.py", ARRAY, output)


def drawing_lesson(middle: float = 1, font: int = 10) -> str:
    code = DRAWING.format(middle=middle, font=font)
    lesson = block("draw.py", code, info="figure=fall.svg")
    return f"## A fall\n\n{lesson}Figure: ![A curve](fall.svg) It falls.\n"


def three_scripts(numbers: str = "123") -> str:
    return "## Three\n\n" + "".join(
        f"{block(f'{name}.py', f'print({number})', '0')}The number {name}: `0`{{out}}.\n\n"
        for name, number in zip("abc", numbers, strict=True)
    )


def recordings(text: str) -> list[dict[str, Any]]:
    """What a record says of outputs and figures."""
    entries = [json.loads(line) for line in text.splitlines() if line.startswith("{")]
    return [entry for entry in entries if entry["is"] == "recording"]


def test_update_writes_what_a_recording_was_made_with(make: Make) -> None:
    folder = make(numpy_lesson("0"))
    update = folder.main("update").require_success()
    assert f"wrote {RECORD}" in update.out
    (recording,) = recordings(folder.text(RECORD))
    assert recording["of"] == "examples/total.py output 1"
    assert (recording["comparison"], recording["provenance"]["python"]) == ("exact", PYTHON)
    assert recording["provenance"]["packages"] == [["numpy", version("numpy")]]
    before = folder.read(RECORD)
    assert folder.main("update").out.startswith("ok ")
    assert folder.read(RECORD) == before
    assert folder.main("build").status == 0
    assert [path for path in folder.tree("public") if "recorded" in path] == []
    page = folder.text("public/lessons/1.1-one.html")
    assert f"with NumPy {version('numpy')}, {PYTHON}." in page and "MuJoCo" not in page


def test_drift_begins_with_what_changed_in_the_environment(make: Make) -> None:
    folder = make(numpy_lesson())
    assert folder.main("update").status == 0
    folder.replace(RECORD, NUMPY, OTHER_NUMPY)
    assert folder.main("check").status == 0, "another version alone is no fault"
    recorded_elsewhere = folder.read(RECORD)
    assert folder.main("update").status == 0
    assert folder.read(RECORD) == recorded_elsewhere, "what holds is not recorded anew"
    folder.replace(folder.lesson(), "arange(3.0)", "arange(4.0)")
    lead = f"the script was edited, and recorded with NumPy 1.26.4, this is {version('numpy')}: "
    assert f"error[output-drift]: {lead}" in folder.main("check").out
    assert folder.main("update").status == 0
    assert NUMPY in folder.text(RECORD), "it was recorded here"
    folder.replace(RECORD, '"exact"', '"digits"')
    folder.replace(RECORD, PYTHON, "Python 3.9.1")
    folder.replace(folder.lesson(), "arange(4.0)", "arange(5.0)")
    lead = f"recorded with Python 3.9.1 and comparison `digits`, this is {PYTHON[7:]} and `exact`"
    assert f"error[output-drift]: the script was edited, and {lead}: " in folder.main("check").out


def test_nothing_is_refused_without_a_record(make: Make) -> None:
    folder = make(numpy_lesson())
    assert folder.main("check").status == 0
    folder.replace(folder.lesson(), "\n3.0\n", "\n2.0\n")
    assert "error[output-drift]: recorded output differs" in folder.main("check").out
    folder.write(RECORD, b'\xff\0{"is":"recording"}\n{"is":"what"}\n[]\n')
    assert "error[output-drift]: recorded output differs" in folder.main("check").out
    assert folder.main("update").status == 0
    assert NUMPY in folder.text(RECORD)


def test_record_goes_with_its_last_recording(make: Make) -> None:
    folder = make(numpy_lesson())
    assert folder.main("update").status == 0
    folder.write(folder.lesson(), GOOD)
    assert folder.main("update").status == 0
    assert "total" not in folder.text(RECORD)
    folder.write(folder.lesson(), "## Nothing runs\n\nHere.\n")
    update = folder.main("update")
    assert f"removed {RECORD}" in update.out
    assert not (folder.root / RECORD).exists()


def test_renamed_lesson_takes_its_record_along(make: Make) -> None:
    folder = make(numpy_lesson())
    assert folder.main("update").status == 0
    before = folder.text(RECORD)
    assert folder.main("rename", "1.1", "1.7").status == 0
    assert not (folder.root / RECORD).exists()
    assert folder.text("content/lessons/1.7-one.recorded.txt") == before


# --------------------------------------------------------------------------- git


def commit(folder: Folder, *options: str) -> None:
    git(folder.root, "add", "-A", *options)
    git(folder.root, "commit", "-q", "-m", "recorded")


def record_on_branch(folder: Folder, branch: str, numbers: str) -> None:
    """Change what one script prints on a branch of its own, and record it there."""
    git(folder.root, "checkout", "-q", "-b", branch, "main")
    text = folder.text(folder.lesson())
    for name, number in zip("abc", numbers, strict=True):
        start = text.index(f"examples/{name}.py")
        end = text.index("```", start)
        text = f"{text[:start]}examples/{name}.py\nprint({number})\n{text[end:]}"
    folder.write(folder.lesson(), text)
    folder.main("update").require_success()
    commit(folder)


def make_repository(folder: Folder) -> None:
    folder.write(".gitignore", ".coursebuild\nexamples/\npublic/\ntmp/\n")
    git(folder.root, "init", "-q", "-b", "main")
    commit(folder)


def merge(folder: Folder) -> None:
    git(folder.root, "checkout", "-q", "left")
    git(folder.root, "merge", "-q", "-m", "merged", "right")
    text = folder.text(RECORD)
    folder.main("check").require_success()
    folder.main("update").require_success()
    of = [recording["of"] for recording in recordings(text)]
    assert of == [f"examples/{name}.py output 1" for name in "abc"]


def test_branches_that_record_other_outputs_merge(make: Make) -> None:
    folder = make(three_scripts())
    assert folder.main("update").status == 0
    make_repository(folder)
    record_on_branch(folder, "left", "723")
    record_on_branch(folder, "right", "193")
    merge(folder)
    before = folder.read(RECORD)
    assert folder.main("update").status == 0
    assert folder.read(RECORD) == before, "each branch's line is the one of its recording"
    assert [f'"text":"{n}"' in before.decode() for n in (7, 9, 3)] == [True] * 3


def test_branches_that_begin_a_record_merge_as_a_new_course_says(
    make: Make, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = make(three_scripts("000"))
    new_course = Folder(tmp_path_factory.mktemp("new"))
    assert new_course.main("init").status == 0
    folder.write(".gitattributes", new_course.read(".gitattributes"))
    make_repository(folder)
    record_on_branch(folder, "left", "700")
    record_on_branch(folder, "right", "090")
    git(folder.root, "checkout", "-q", "left")
    git(folder.root, "merge", "-q", "-m", "merged", "right")
    assert folder.main("check").status == 0
    assert folder.main("update").status == 0
    assert len(recordings(folder.text(RECORD))) == 3, "what the merge left over is gone"


def test_marks_of_a_conflict_in_a_record_harm_nothing(make: Make) -> None:
    folder = make(numpy_lesson())
    assert folder.main("update").status == 0
    line = folder.text(RECORD).replace(NUMPY, OTHER_NUMPY)
    theirs = line.replace('"digest":"', '"digest":"00')
    folder.write(RECORD, f"<<<<<<< ours\n{line}=======\n{theirs}>>>>>>> theirs\n")
    assert folder.main("check").status == 0
    folder.replace(folder.lesson(), "arange(3.0)", "arange(4.0)")
    assert "recorded with NumPy 1.26.4, this is" in folder.main("check").out
    assert folder.main("update").status == 0
    assert len(recordings(folder.text(RECORD))) == 1 and "<<<<" not in folder.text(RECORD)


# --------------------------------------------------------------------------- figures


def test_figure_of_another_version_is_compared_by_what_it_draws(make: Make) -> None:
    folder = make(drawing_lesson())
    assert folder.main("update").status == 0
    version_here = f'["matplotlib","{version("matplotlib")}"]'
    folder.write(folder.lesson(), drawing_lesson(font=17))
    check = folder.main("check")
    assert "the recorded figure differs" in check.out, "the same version draws the same"
    folder.replace(RECORD, version_here, '["matplotlib","3.9.0"]')
    assert folder.main("check").status == 0, "the layout of another version is not this one's"
    assert "not yet repeated" not in folder.main("check", "--no-cache").out
    before = folder.read("content/lessons/fall.svg")
    assert folder.main("update").status == 0
    assert folder.read("content/lessons/fall.svg") == before
    folder.write(folder.lesson(), drawing_lesson(middle=1.5, font=17))
    check = folder.main("check")
    assert (
        "error[figure-drift]: the script was edited, and recorded with Matplotlib 3.9.0, "
        f"this is {version('matplotlib')}: the recorded figure differs from this run: "
        "the curve “fall” has its point 2 of 3 at (1, 1.5) where (1, 1) is recorded\n"
    ) in check.out
    assert folder.main("update").status == 0
    assert version_here in folder.text(RECORD)
    assert folder.main("check").status == 0


def test_figure_recorded_before_gets_its_data(make: Make) -> None:
    folder = make(drawing_lesson())
    assert folder.main("update").status == 0
    with_data = folder.text("content/lessons/fall.svg")
    start, end = with_data.index('<metadata class="drawn">'), with_data.index("</metadata>")
    bare = with_data[:start] + with_data[end + len("</metadata>") :]
    folder.write("content/lessons/fall.svg", bare)
    (folder.root / RECORD).unlink()
    assert folder.main("check").status == 0
    assert folder.main("update").status == 0
    assert folder.text("content/lessons/fall.svg") == with_data
    assert 'fall.svg",' in folder.text(RECORD)
    assert folder.main("build").status == 0
    assert folder.text("public/files/lessons/fall.svg") == bare, "readers get the drawing alone"


# --------------------------------------------------------------------------- preview


def test_accepted_output_is_recorded_with_what_printed_it(make: Make) -> None:
    folder = make(numpy_lesson("2.0"))
    with serve_preview(folder) as preview, preview.events() as events:
        (output,) = events.offered()
        assert preview.accept_offer(output["offer"]) == (200, {"message": ""})
        events.wait_until_settled()
    assert NUMPY in folder.text(RECORD)
    assert folder.main("update").out.startswith("ok "), "there is nothing left to record"


# --------------------------------------------------------------------------- texts


def test_versions_stand_on_pages_of_every_language() -> None:
    texts = [text for path, text in template_texts() if Path(path).parent.name == "strings"]
    assert len(texts) >= 5
    for text in texts:
        receipt = text[text.index("[receipt]") : text.index("[mjcf]")]
        assert receipt.count("{versions}") == 5 and "MuJoCo" not in receipt
