"""Downloaded archives run elsewhere, with the course's own packages."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from support.scratch_course import Make, block

pytestmark = pytest.mark.site

CODE = """from mjcourse import OWN
from pkg.part import word

print(OWN, word())
"""
FILES = {
    "src/pkg/part.py": """import pathlib, period

def word() -> str:
    return (pathlib.Path(__file__).parent / "word.txt").read_text() + period.END
""",
    "src/pkg/word.txt": "swing",
    "lib/period.py": 'END = "."\n',
    "lib/pkg/part.py": "never found",
    "src/mjcourse.py": "OWN = True\n",
    "src/other.py": "never imported",
}


def test_unpacked_archive_runs_with_the_packages_of_the_course(make: Make, tmp_path: Path) -> None:
    folder = make("## A\n\n" + block("a.py", CODE, "True swing."))
    folder.replace("content/course.toml", "[course]\n", '[course]\npackages = ["src", "lib"]\n')
    for path, text in FILES.items():
        folder.write(path, text)
    build = folder.run("build")
    assert build.status == 0, build.out
    for name in ("examples.zip", "lessons/1.1-one.zip"):
        with zipfile.ZipFile(folder.root / "public" / name) as archive:
            archive.extractall(tmp_path / name)
            assert not [
                name_in_archive
                for name_in_archive in archive.namelist()
                if "other" in name_in_archive
            ]
        (top,) = (tmp_path / name).iterdir()
        assert (top / "requirements.txt").read_text() == ""
        command = [sys.executable, "-S", "examples/a.py"]
        result = subprocess.run(command, cwd=top, capture_output=True, text=True, check=False)
        assert (result.stdout, result.stderr) == ("True swing.\n", "")
    folder.write("src/pkg/word.txt", "turn")
    assert "differs from this run" in folder.run("check").out
