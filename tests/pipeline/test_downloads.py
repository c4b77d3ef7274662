"""What readers download of scripts runs by itself; what does not has no button, and only that."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder, Make, block

pytestmark = pytest.mark.site

MODEL = '<mujoco><worldbody><body><freejoint/><geom size=".1"/></body></worldbody></mujoco>\n'
HELPED = fixture_text("documents/downloads_helped.md")
LESSON = fixture_text("documents/downloads.md")


def run(folder: Path, entry: str, *args: str) -> str:
    command = [sys.executable, entry, *args]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    return done.stdout + done.stderr


def unpack(folder: Folder, path: str) -> zipfile.ZipFile:
    return zipfile.ZipFile(io.BytesIO(folder.read(path)))


def test_what_a_page_hands_over_runs_alone_or_has_no_button(make: Make, tmp_path: Path) -> None:
    folder = make(LESSON)
    folder.write("models/ball.xml", MODEL)
    folder.write("runs/data.csv", "1,2")
    build = folder.main("build")
    assert build.status == 1
    assert build.out.count("error[") == 1
    assert "error[download-failed]: what readers download of `examples/astray.py`" in build.out
    page = folder.text("public/lessons/1.1-one.html")
    addresses = ("helped.py", "zipped.zip", "names.py", "astray.py", "absent.py", "args.py")
    buttons = [f'href="../examples/{name}" download' in page for name in addresses]
    assert buttons == [True, True, True, False, True, True]

    absent = page.partition('data-script="examples/absent.py"')[2].partition("</figure>")[0]
    assert "<code>python absent.py</code>" in absent and "needs torch" in absent
    assert "python args.py WORD" in folder.text("public/examples/args.py")
    assert "pip install" not in absent and "uv run" not in absent, "the package is not known"
    assert "package of the module torch was not known" in folder.text("public/examples/absent.py")

    (tmp_path / "helped.py").write_bytes(folder.read("public/examples/helped.py"))
    assert run(tmp_path, "helped.py") == "a ball 7 1,2\n"
    text = (tmp_path / "helped.py").read_text()
    assert text.startswith("# /// script\n") and '#     "mujoco==' in text
    with unpack(folder, "public/examples/zipped.zip") as archive:
        archive.extractall(tmp_path)
    assert run(tmp_path / "zipped", "examples/zipped.py") == "a ball 7 1,2\n"
    assert (tmp_path / "zipped" / "requirements.txt").read_text().startswith("mujoco==")

    assert "<code>uv run helped.py</code>" in page
    assert "<code>uv run args.py &#39;a b&#39;</code>, or <code>python args.py" in page
    assert "unpack zipped.zip, and in its folder <code>uv run --with-requirements" in page
    assert page.count("not run alone") == 1

    folder.write("content/lessons/1.1-one.md", LESSON.replace('isdir("content")', 'isdir(".")'))
    folder.main("build").require_success()
    assert 'astray.py" download' in folder.text("public/lessons/1.1-one.html")


STYLED = fixture_text("scripts/styled.txt")
ABSENT = "import os.path\nimport torch.nn\n"
ARM = "<mujoco><include file='part.xml'/></mujoco>\n"
PART = "<mujocoinclude><worldbody><geom size='.1'/></worldbody></mujocoinclude>\n"
IN_ARCHIVE = """
README.md examples/helped.py examples/names.py examples/styled.py matplotlibrc models/arm.xml
models/ball.xml models/part.xml requirements.txt runs/data.csv
"""


def test_an_archive_of_a_lesson_holds_what_its_scripts_need(make: Make, tmp_path: Path) -> None:
    name = block("names.py", 'NAME = "a ball"\n') + block("absent.py", ABSENT, info="norun")
    styled = block("styled.py", STYLED, "1 mjcourse.spatial 11.0")
    helped = block("helped.py", HELPED, "a ball 7 1,2")
    folder = make(f"## One\n\n{helped}{styled}", f"## Two\n\n{name}")
    for path, text in {
        "models/ball.xml": MODEL,
        "models/arm.xml": ARM,
        "models/part.xml": PART,
        "models/box.xml": MODEL,
        "runs/data.csv": "1,2",
        "matplotlibrc": "font.size: 11\n",
    }.items():
        folder.write(path, text)
    folder.main("build").require_success()
    with unpack(folder, "public/lessons/1.1-one.zip") as archive:
        paths = [path for path in archive.namelist() if "/mjcourse/" not in path]
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {entry.external_attr >> 16 for entry in archive.infolist()} == {0o100644}
        archive.extractall(tmp_path)
    unpacked = tmp_path / "1.1-one"
    assert paths == [f"1.1-one/{path}" for path in IN_ARCHIVE.split()]
    assert run(unpacked, "examples/helped.py") == "a ball 7 1,2\n"
    assert run(unpacked, "examples/styled.py") == "1 mjcourse.spatial 11.0\n"
    requirements = (unpacked / "requirements.txt").read_text().splitlines()
    assert [line.partition("==")[0] for line in requirements] == [
        *("matplotlib", "mujoco", "numpy", "PyYAML"),
    ]
    assert "python examples/helped.py\n" in (unpacked / "README.md").read_text()

    with unpack(folder, "public/lessons/1.2-two.zip") as archive:
        unknown = archive.read("1.2-two/requirements.txt").decode()
    assert unknown == "# the package of the module torch was not known\n"
    with unpack(folder, "public/examples.zip") as archive:
        paths = {path.partition("/")[2] for path in archive.namelist()}
    assert paths >= {"examples/absent.py", "examples/helped.py", "runs/data.csv"}


def test_a_download_is_made_again_when_what_it_imports_or_reads_has_changed(make: Make) -> None:
    lesson = block("helped.py", HELPED, "a ball 7 1,2") + block("names.py", 'NAME = "a ball"\n')
    folder = make(f"## One\n\n{lesson}")
    folder.write("models/ball.xml", MODEL)
    folder.write("runs/data.csv", "1,2")

    def download() -> str:
        assert folder.main("build").status == 0
        return folder.text("public/examples/helped.py")

    assert "1,2" in download()
    path = "content/lessons/1.1-one.md"
    folder.write(path, folder.text(path).replace("a ball", "a stone"))
    assert 'NAME = "a stone"' in download()
    folder.write("runs/data.csv", "3,4")
    folder.write(path, folder.text(path).replace("7 1,2", "7 3,4"))
    assert "1,2" not in download()
