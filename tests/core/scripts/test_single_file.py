"""A script as one file: it prints what it prints with its modules beside it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.scripts.module_code import CourseModule, NotOneFileError
from coursebuild.core.scripts.single_file import Belongings, single_file
from coursebuild.core.text.python_code import find_imports
from support.fixture_cases import Case, fixture_tables, read_cases

CASES = read_cases(Path(__file__).with_name("single_files.md"))


def parts(text: str) -> dict[str, str]:
    """The modules of a case by their dotted names; the script itself is `script`."""
    modules: dict[str, str] = {}
    for part in text.split("# === ")[1:]:
        name, _, body = part.partition("\n")
        modules[name] = body
    return modules


def one_file(modules: dict[str, str], belongings: Belongings | None = None) -> str:
    sources = {
        name.removesuffix(".__init__"): CourseModule(f"{name.replace('.', '/')}.py", text)
        for name, text in modules.items()
    }
    script = sources.pop("script").text
    return single_file("script", script, sources.get, belongings or Belongings())


def run(folder: Path, name: str = "script.py") -> str:
    done = subprocess.run(
        [sys.executable, name], cwd=folder, capture_output=True, text=True, check=False
    )
    return done.stdout + done.stderr


@pytest.mark.parametrize("case", CASES, ids=[case.title for case in CASES])
def test_one_file_prints_what_script_and_modules_print(case: Case, tmp_path: Path) -> None:
    modules = parts(case.input)
    for name, text in modules.items():
        path = tmp_path / "beside" / f"{name.replace('.', '/')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    (tmp_path / "alone").mkdir()
    text = one_file(modules)
    (tmp_path / "alone" / "script.py").write_text(text, encoding="utf-8")
    assert run(tmp_path / "beside") == run(tmp_path / "alone") == case.expected, text


REFUSED = fixture_tables("single_files")["refused"]


@pytest.mark.parametrize("name", REFUSED)
def test_script_that_cannot_be_one_file_is_refused(name: str) -> None:
    script, module = REFUSED[name]
    with pytest.raises(NotOneFileError):
        one_file({"script": script, "m": module})


def test_models_and_data_are_in_the_file(tmp_path: Path) -> None:
    script = (
        "from mjcourse import model_path\n\n"
        'print(model_path("arms/small").read_text())\n'
        'print(open("runs/a.csv").read())\n'
    )
    belongings = Belongings(
        {"arms/small.xml": '<mujoco model="a\\b"/>\n'}, {"runs/a.csv": '1,2\n"3"\n'}
    )
    library = {
        "mjcourse": "from mjcourse.paths import model_path\n",
        "mjcourse.paths": "def model_path(name): ...\n",
    }
    text = one_file({"script": script, **library}, belongings)
    (tmp_path / "script.py").write_text(text, encoding="utf-8")
    assert run(tmp_path) == '<mujoco model="a\\b"/>\n\n1,2\n"3"\n\n'
    assert find_imports(text) <= sys.stdlib_module_names


def test_own_lines_stay_as_they_are() -> None:
    script = (
        '"""What it does."""\n\nimport math\n\nfrom m import a\n\n# why\nprint(a, math.pi)  # so\n'
    )
    text = one_file({"script": script, "m": "a = 1\n"})
    assert text.startswith('"""What it does."""\n\nimport math\n')
    assert text.endswith("# why\nprint(a, math.pi)  # so\n")
