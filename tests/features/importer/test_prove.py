"""`coursebuild import --prove`: what running shows, and what becomes of cells that cannot run."""

from __future__ import annotations

import base64
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coursebuild.cli import main

pytestmark = pytest.mark.site

ABSENT = "a_package_that_nobody_has"
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
"""One pixel."""


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
        "height = 2\nheight += 1\ndisplay(height)",
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
    assert "print(height)\n```\n\n```output\n3\n```" in text
    assert lesson(folder / "new", "1.2-b").startswith(
        "```python\nprint(1 / 0)\n```\n\n*Not run here:* `Zero"
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
    assert "1.1-a.md:6: the recorded output does not hold here" in account
    before = files_of(folder / "new")
    assert main(["-C", "new", "import", "--prove"]) == 1
    assert files_of(folder / "new") == before


def test_a_script_gets_the_folder_that_it_writes_to(folder: Path) -> None:
    code = "import os\nos.makedirs('runs', exist_ok=True)\nopen('runs/a.txt', 'w').write('x')"
    write_notebook(folder / "old/a.ipynb", f"{code};")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    assert " writes=runs/\n" in lesson(folder / "new", "1.1-a")


def test_a_picture_that_a_notebook_holds_is_shown_until_its_script_has_drawn_it(
    folder: Path,
) -> None:
    picture = base64.b64encode(PNG).decode()
    plot = "import matplotlib.pyplot as plt\nplt.plot([1, 2])\nplt.title('A line')\nplt.show()"
    outputs = [{"output_type": "display_data", "data": {"image/png": picture}}]
    shell = [{"output_type": "stream", "name": "stdout", "text": "listed\n"}, *outputs]
    cells = [
        {"cell_type": "code", "source": plot, "outputs": outputs},
        {"cell_type": "code", "source": "%%bash\nls", "outputs": shell},
    ]
    (folder / "old").mkdir()
    notebook = {"cells": cells, "metadata": {}, "nbformat": 4}
    (folder / "old/a.ipynb").write_text(json.dumps(notebook))
    assert main(["import", "old", "--out", "new"]) == 0
    text = lesson(folder / "new", "1.1-a")
    assert "```python file=examples/l1_1_a.py figure=l1-1-a-1.png\n" in text
    assert "Figure: ![A line](l1-1-a-1.png) A line" in text
    shell_script = "```bash file=examples/l1_1_a.sh\nls\n```\n\n```output\nlisted\n```"
    assert f"{shell_script}\n\n![A](l1-1-a-2.png)" in text
    files = [folder / f"new/content/lessons/l1-1-a-{number}.png" for number in (1, 2)]
    assert [path.read_bytes() for path in files] == [PNG, PNG]
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert files[0].read_bytes().startswith(b"\x89PNG") and files[0].read_bytes() != PNG
    assert files[1].read_bytes() == PNG


def test_a_page_says_which_figure_is_not_drawn_yet(folder: Path) -> None:
    write_notebook(folder / "old/a.ipynb", "print(1)", printed="1\n")
    assert main(["import", "old", "--out", "new"]) == 0
    path = folder / "new/content/lessons/1.1-a.md"
    head = f"l1_1_a.py figure=f.svg requires={ABSENT}"
    text = path.read_text().replace("l1_1_a.py", head)
    path.write_text(f"{text}\nFigure: ![A line](f.svg) What it shows.\n")
    assert main(["-C", "new", "build"]) == 0
    page = (folder / "new/public/lessons/1.1-a.html").read_text()
    figure = re.search(r'<figure class="figure".*?</figure>', page, re.DOTALL)
    assert figure is not None and "Not drawn yet" in figure[0] and "What it shows." in figure[0]
    assert "<img" not in figure[0]


def runs_in(progress: str) -> list[int]:
    """How often the scripts of the lessons a, b and c ran, as a command says on standard error."""
    return [progress.count(f"  examples/l1_{number}_{name}.py: ") for number, name in NAMES]


NAMES = ((1, "a"), (2, "b"), (3, "c"))


def test_each_script_runs_at_most_twice_however_many_cells_fail(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    failing = [f"x{number} = [][{number}]" for number in range(12)]
    codes = [code for number, code in enumerate(failing) for code in (code, f"print({number})")]
    write_notebook(folder / "old/a.ipynb", "x = 1", *codes, f"import {ABSENT}\nprint(7)")
    write_notebook(folder / "old/b.ipynb", "print('fine', 1.5)")
    write_notebook(folder / "old/c.ipynb", "print(2)", printed="2\n")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    text = lesson(folder / "new", "1.1-a")
    assert text.count("*Not run here:* `IndexError: list index out of range`") == len(failing)
    assert all(f"```output\n{number}\n```" in text for number in range(len(failing)))
    assert "part\nprint(7)\n```\n\n```output\n7\n```" in text
    report = capsys.readouterr()
    assert runs_in(report.err) == [2, 2, 2]
    assert "not yet repeated" not in report.out
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert runs_in(capsys.readouterr().err) == [0, 0, 0]


def test_a_cell_that_fails_only_without_another_ends_what_is_run(folder: Path) -> None:
    """What the failing cell had done before it failed made the one below possible."""
    changing = "names = {}"
    write_notebook(
        folder / "old/a.ipynb", changing, "names.update(a=1)\n1 / 0", "print(names['a'])"
    )
    main(["import", "old", "--out", "new", "--prove"])
    text = lesson(folder / "new", "1.1-a")
    assert "print(names['a'])\n```\n\n*Not run here:* `KeyError: 'a'`" in text


def test_an_output_that_varies_says_so(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clock = (
        "import time\nprint('mass 4.79 kg')\nprint('it took', time.perf_counter_ns() * 1e-9, 's')"
    )
    write_notebook(folder / "old/a.ipynb", clock)
    write_notebook(folder / "old/b.ipynb", "import os\nprint(os.urandom(4).hex())")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    assert '```output digits volatile="it took [-+.0-9a-fxE]+"\n' in lesson(folder / "new", "1.1-a")
    assert "```output volatile\n" in lesson(folder / "new", "1.2-b")
    out = capsys.readouterr().out
    assert "everything holds" in out and "two runs differ, so an output is `volatile`" in out
    path = folder / "new/content/lessons/1.1-a.md"
    path.write_text(path.read_text().replace("\nmass 4.79", "\nmass 4.78"))
    assert main(["-C", "new", "check"]) == 1


def test_what_takes_long_is_recorded_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_notebook(folder / "old/a.ipynb", "print('trained')", "1 / 0")
    write_notebook(folder / "old/b.ipynb", "print('trained')")
    assert main(["import", "old", "--out", "new", "--prove", "--once", "0"]) == 0
    for name in ("1.1-a", "1.2-b"):
        assert " record=once\n" in lesson(folder / "new", name)
    assert len([*(folder / "new/content/reports").glob("*.run.json")]) == 2
    assert runs_in(capsys.readouterr().err) == [2, 1, 0]
    assert main(["-C", "new", "check"]) == 0
    assert runs_in(capsys.readouterr().err) == [0, 0, 0]


@pytest.mark.parametrize(
    ("module", "sentence"),
    [
        ("sklearn.svm", "the package `scikit-learn` brings `sklearn`"),
        (ABSENT, f"the module `{ABSENT}` is missing; which package brings it is not known here"),
    ],
)
def test_a_package_is_named_only_where_it_is_known(
    folder: Path, capsys: pytest.CaptureFixture[str], module: str, sentence: str
) -> None:
    write_notebook(folder / "old/a.ipynb", f"import {module}")
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    assert sentence in capsys.readouterr().out
    assert f"requires={module.partition('.')[0]}" in lesson(folder / "new", "1.1-a")


def test_text_that_says_what_is_printed_no_more_is_reported(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cells = [
        {"cell_type": "markdown", "source": "# Mass\n\nIt weighs 4.812 kg, or 17 lb."},
        {
            "cell_type": "code",
            "source": "print('mass', 4.792, 'or', 18)",
            "outputs": [{"output_type": "stream", "name": "stdout", "text": "mass 4.812 or 17\n"}],
        },
    ]
    (folder / "old").mkdir()
    notebook = {"cells": cells, "metadata": {}, "nbformat": 4}
    (folder / "old/a.ipynb").write_text(json.dumps(notebook))
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    sentence = "1.1-a.md:1 says `4.812` as was recorded, but `4.792` is printed"
    assert sentence in capsys.readouterr().out
    assert sentence in (folder / "new/IMPORT.md").read_text()


def test_the_account_says_first_what_contradicts_the_course_each_with_its_place(
    folder: Path,
) -> None:
    cells = [
        {"cell_type": "code", "source": f"import {ABSENT} as absent", "outputs": []},
        {"cell_type": "code", "source": "import math\nmath.gone(1)", "outputs": []},
        {"cell_type": "code", "source": "absent.run()", "outputs": []},
        {
            "cell_type": "code",
            "source": "print('mass', 4.79)",
            "outputs": [{"output_type": "stream", "name": "stdout", "text": "mass 4.81\n"}],
        },
        {"cell_type": "markdown", "source": "# Mass\n\nIt weighs 4.81 kg. $16/70 = 17/70$"},
    ]
    (folder / "old").mkdir()
    (folder / "old/a.ipynb").write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4}))
    assert main(["import", "old", "--out", "new", "--prove"]) == 1
    path = "content/lessons/1.1-a.md"
    lines = (folder / "new" / path).read_text().splitlines()

    def place(*words: str) -> str:
        pairs = zip(*(lines[n:] for n in range(len(words))), strict=False)
        matches = (all(map(str.__contains__, pair, words)) for pair in pairs)
        return f"{path}:{[*matches].index(True) + 1}"

    account = (folder / "new/IMPORT.md").read_text()
    assert account.partition("## What does not hold\n\n")[2].splitlines()[:8] == [
        f"- {place('16/70')}: 0.2285714286 = 0.2428571429 does not hold",
        "",
        "## What running showed",
        "",
        f"- {place('weighs')} says `4.81` as was recorded, but `4.79` is printed",
        f"- {place('mass 4.79')}: the recorded output does not hold here and is replaced: "
        "`4.81` was recorded, `4.79` is printed",
        f"- {place('```python', 'import math')}: `AttributeError: module 'math' has no attribute "
        "'gone'`, so the cell is not run",
        f"- examples/l1_1_a.py: 2 cells shown, not run: ModuleNotFoundError: No module named "
        f"'{ABSENT}'",
    ]
    (folder / "new" / path).write_text("\n".join(lines).replace("$16/70 = 17/70$", ""))
    main(["-C", "new", "import", "--prove"])
    assert (
        account.partition("## What running")[2]
        == ((folder / "new/IMPORT.md").read_text().partition("## What running")[2])
    )
    assert "## What does not hold" not in (folder / "new/IMPORT.md").read_text()


def test_a_proof_that_was_killed_goes_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wait = f"import os\nwhile not os.path.exists({str(folder / 'go')!r}):\n    pass"
    write_notebook(folder / "old/a.ipynb", "print(1)")
    write_notebook(folder / "old/b.ipynb", wait, "print(2)")
    assert main(["import", "old", "--out", "new"]) == 0
    command = [sys.executable, "-m", "coursebuild", "-C", "new", "import", "--prove", "--jobs", "1"]
    progress = folder / "progress"
    with (
        progress.open("w") as stderr,
        subprocess.Popen(command, stderr=stderr, start_new_session=True) as process,
    ):
        while not re.search("a.py: ok(.|\\n)*b.py", progress.read_text()):
            assert process.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
    (folder / "go").touch()
    capsys.readouterr()
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert "```output\n2\n```" in lesson(folder / "new", "1.2-b")
    assert runs_in(progress.read_text() + capsys.readouterr().err)[0] == 2


def test_a_figure_that_a_cell_saves_itself_is_shown_and_leaves_no_other_file(
    folder: Path,
) -> None:
    drawing = "import matplotlib.pyplot as plt\nplt.plot([1, 2])\nplt.title('A rise')\n"
    write_notebook(
        folder / "old/a.ipynb",
        f"{drawing}plt.savefig('plots/First Rise.png', dpi=50)\nplt.show()",
        "plt.imsave('pixels.png', [[0.0, 1.0], [1.0, 0.0]])\nprint('saved')",
        "plt.savefig('second.png')\nraise SystemError('late')",
    )
    assert main(["import", "old", "--out", "new", "--prove"]) == 0
    text = lesson(folder / "new", "1.1-a")
    assert "figure=first-rise.png,pixels.png\n" in text
    assert "Figure: ![A rise](first-rise.png) A rise" in text
    assert "Figure: ![A](pixels.png) A" in text
    assert "second.png)" not in text
    pictures = {path for path in files_of(folder / "new") if path.endswith(".png")}
    assert pictures == {"content/lessons/first-rise.png", "content/lessons/pixels.png"}
    assert main(["-C", "new", "check"]) == 0


def test_a_cell_of_a_shell_runs_when_the_map_says_how(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_notebook(folder / "old/a.ipynb", "%%bash\necho 6", printed="7\n")
    (folder / "old/b.qmd").write_text(
        "# B\n\n```{sh}\n#| echo: false\necho one\n```\n\n```{sh}\necho two\n```\n"
    )
    assert main(["import", "old", "--out", "new"]) == 0
    assert "`[runners]` of the map says how" in capsys.readouterr().out
    assert "```bash file=examples/l1_1_a.sh\necho 6\n```" in lesson(folder / "new", "1.1-a")
    text = lesson(folder / "new", "1.2-b")
    assert "```sh file=examples/l1_2_b.sh hidden\necho one\n```" in text
    assert "```sh file=examples/l1_2_b_2.sh\necho two\n```" in text
    course_map = folder / "new/content/course.toml"
    runners = '\n[runners]\nbash = [["bash", "{file}"]]\nsh = [["sh", "{file}"]]\n'
    course_map.write_text(course_map.read_text().replace("\n[[level]]", f"{runners}\n[[level]]", 1))
    assert main(["-C", "new", "check"]) == 1
    assert "7" in capsys.readouterr().out
    assert main(["-C", "new", "import", "--prove"]) == 0
    assert "```output\n6\n```" in lesson(folder / "new", "1.1-a")
    assert "echo two\n```\n\n```output\ntwo\n```" in lesson(folder / "new", "1.2-b")
