import multiprocessing
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import mjcourse
from mjcourse import ModelNotFoundError
from support.fixture_cases import check_lines, fixture_text

PACKAGE = Path(mjcourse.__file__).parents[1]
ASK = "from mjcourse import model_path\nprint(model_path('box'))\n"


def write(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def course(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    write(root / "content" / "course.toml")
    for name in ("box", "tumbling_box", "pendulum", "arms/ur5", "arms/panda", "v1.2"):
        write(root / "models" / f"{name}.xml", "<mujoco/>")
    write(root / "models" / "readme.txt")
    return root


def ask(script: Path, name: object = "box", run_name: str = "__main__") -> Path:
    scope: dict[str, object] = {"__name__": run_name, "__file__": str(script), "name": name}
    exec("from mjcourse import model_path\nfound = model_path(name)", scope)
    path = scope["found"]
    assert isinstance(path, Path)
    return path


def run(script: Path | str, *arguments: str, cwd: Path, code: str | None = None) -> str:
    process = subprocess.run(
        [sys.executable, "-W", "error", str(script), *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        input=code,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout.strip()


def test_names_from_anywhere_in_the_course(course: Path) -> None:
    for name, file in {
        "box": "box.xml",
        "box.xml": "box.xml",
        "arms/ur5": "arms/ur5.xml",
        "v1.2": "v1.2.xml",
        "v1.2.xml": "v1.2.xml",
    }.items():
        assert ask(course / "examples" / "x.py", name) == course / "models" / file
    for folder in ("", "examples/deep/down", "content/lessons", "models"):
        assert ask(course / folder / "x.py") == course / "models" / "box.xml"


def test_a_downloaded_course_has_no_content(tmp_path: Path) -> None:
    root = tmp_path / "unpacked"
    write(root / "models" / "box.xml")
    script = write(root / "examples" / "x.py")
    assert ask(script) == root / "models" / "box.xml"
    assert ask(root / "my_own.py") == root / "models" / "box.xml"


def test_a_models_folder_alone_is_no_course(tmp_path: Path) -> None:
    write(tmp_path / "models" / "box.xml")
    script = tmp_path / "x.py"
    with pytest.raises(ModelNotFoundError) as caught:
        ask(script)
    assert str(caught.value) == (
        f"no course for model 'box': no folder at or above {script} has content/course.toml, "
        "nor models/ beside examples/"
    )


def test_a_course_without_models(course: Path) -> None:
    for file in [*course.joinpath("models").rglob("*.xml")]:
        file.unlink()
    with pytest.raises(ModelNotFoundError) as caught:
        ask(course / "x.py")
    assert str(caught.value) == f"no model 'box': {course / 'models'} holds no .xml file"
    (course / "models").rename(course / "meshes")
    with pytest.raises(ModelNotFoundError) as caught:
        ask(course / "x.py")
    assert str(caught.value) == f"no model 'box': there is no folder {course / 'models'}"


def test_a_name_of_no_model_says_why_and_what_is_near(course: Path, rewriting: bool) -> None:
    def convert(name: str) -> list[str]:
        with pytest.raises((ValueError, ModelNotFoundError)) as caught:
            ask(course / "examples" / "x.py", name)
        return [str(caught.value).replace(str(course), "COURSE")]

    check_lines(Path(__file__).with_name("model_names.md"), convert, rewriting=rewriting)


def test_links_may_not_lead_out_of_models(course: Path, tmp_path: Path) -> None:
    models = course / "models"
    secret = write(tmp_path / "outside" / "secret.xml")
    (models / "same.xml").symlink_to("box.xml")
    (models / "file.xml").symlink_to(secret)
    (models / "folder").symlink_to(secret.parent, target_is_directory=True)
    assert ask(course / "x.py", "same") == models / "same.xml"
    for name in ("file", "folder/secret"):
        with pytest.raises(ValueError) as caught:
            ask(course / "x.py", name)
        assert str(caught.value) == f"model {name!r} is a link that leads out of {models}"


def test_broken_and_circular_links_are_missing(course: Path) -> None:
    (course / "models" / "gone.xml").symlink_to("nowhere.xml")
    (course / "models" / "loop.xml").symlink_to("loop.xml")
    for name in ("gone", "loop"):
        with pytest.raises(ModelNotFoundError):
            ask(course / "x.py", name)


def test_a_linked_script_belongs_where_it_lies_or_where_it_leads(
    course: Path, tmp_path: Path
) -> None:
    script = write(course / "examples" / "x.py")
    link = tmp_path / "bin" / "x.py"
    link.parent.mkdir()
    link.symlink_to(script)
    assert ask(link) == course / "models" / "box.xml"
    inside = course / "examples" / "linked.py"
    inside.symlink_to(write(tmp_path / "elsewhere" / "y.py"))
    assert ask(inside) == course / "models" / "box.xml"


def test_the_error_survives_pickling(course: Path) -> None:
    with pytest.raises(ModelNotFoundError) as caught:
        ask(course / "x.py", "nothing_like_it")
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is ModelNotFoundError
    assert str(again) == str(caught.value)


def test_a_helper_outside_the_course_acts_for_the_script(course: Path, tmp_path: Path) -> None:
    helper: dict[str, object] = {"__name__": "helper", "__file__": str(tmp_path / "lib" / "h.py")}
    exec("from mjcourse import model_path\ndef load(): return model_path('box')", helper)
    script = {
        "__name__": "__main__",
        "__file__": str(course / "examples" / "x.py"),
        "load": helper["load"],
    }
    exec("found = load()", script)
    assert script["found"] == course / "models" / "box.xml"


SCRIPT = fixture_text("scripts/paths.txt")
SIBLING = fixture_text("scripts/paths_sibling.txt")


@pytest.mark.site
def test_a_real_script_from_any_folder(course: Path) -> None:
    write(course / "examples" / "x.py", SCRIPT)
    write(course / "examples" / "sibling.py", SIBLING)
    out = run("examples/x.py", cwd=course)
    call_count = 6 + 2 * len(multiprocessing.get_all_start_methods())
    assert out.split() == [str(course / "models" / "box.xml")] * call_count


@pytest.mark.site
def test_modules_code_and_prompts(course: Path, tmp_path: Path) -> None:
    expected = str(course / "models" / "box.xml")
    script = write(course / "examples" / "x.py", ASK)
    assert run("-m", "examples.x", cwd=course) == expected
    assert run("-", cwd=course, code=ASK) == expected
    after = run("-i", str(script), cwd=tmp_path, code="print(model_path('v1.2'))\n")
    assert str(course / "models" / "v1.2.xml") in after


@pytest.mark.site
def test_code_in_a_folder_that_is_gone_is_in_no_course(tmp_path: Path) -> None:
    code = (
        "from mjcourse import model_path\n"
        "try: model_path('box')\n"
        "except FileNotFoundError as error: print(error)\n"
    )
    removal = f"import os; os.mkdir('x'); os.chdir('x'); os.rmdir({str(tmp_path / 'x')!r})\n"
    assert "no course for model 'box'" in run("-c", removal + code, cwd=tmp_path)
