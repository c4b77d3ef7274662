"""Completions of a shell: commands, options, names in the course, files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.scratch_course import FIRST, SECOND, Folder, Make

pytestmark = pytest.mark.site


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(FIRST, SECOND)
    folder.write("models/pendulum.xml", "<mujoco/>\n")
    return folder


def complete(folder: Folder, *line: str, cwd: Path | None = None) -> list[str]:
    result = folder.main("completion", "bash", "--", *line, cwd=cwd)
    assert (result.status, result.err) == (0, "")
    return result.out.split("\n")[:-1]


def test_words_are_completed_by_where_they_stand(course: Folder, tmp_path: Path) -> None:
    assert complete(course, "c") == ["check", "completion"]
    assert {"help", "check", "bench", "-C"} < {*complete(course, "")}
    assert complete(course, "help", "sta") == ["stability"]
    assert complete(course, "check", "--fo") == ["--format"]
    assert complete(course, "check", "--format", "j") == ["json", "junit"]
    assert complete(course, "check", "--out-of", "") == ["1.1", "1.2"]
    assert complete(course, "check", "--timings", "") == [], "the shell completes a file"
    assert complete(course, "update", "1.1", "1") == ["1.1", "1.2"]
    assert complete(course, "bench", "--quick", "") == ["pendulum"]
    assert complete(course, "explain", "output-d") == ["output-drift"]
    assert complete(course, "schema", "") == ["course", "lab", "model", "quiz"]
    assert "epub" in complete(course, "export", "")
    assert complete(course, "nosuch", "") == []
    elsewhere = ("-C", str(course.root), "check", "1")
    assert complete(course, *elsewhere, cwd=tmp_path) == ["1.1", "1.2"]
    for text in ("", "[", "level = 3", "[[level]]\nlesson = 2", "\x00"):
        course.write("content/course.toml", text)
        assert complete(course, "check", "") == [], text


def test_shells_take_what_is_printed(course: Folder, tmp_path: Path) -> None:
    bin = tmp_path / "bin"
    bin.mkdir()
    (bin / "coursebuild").write_text(f'#!/bin/sh\nexec {sys.executable} -m coursebuild "$@"\n')
    (bin / "coursebuild").chmod(0o755)
    bash = shutil.which("bash")
    assert bash is not None
    code = (
        f'PATH="{bin}:$PATH"; eval "$(coursebuild completion bash)"; complete -p coursebuild\n'
        'COMP_WORDS=(coursebuild check 1.2); COMP_CWORD=2; _coursebuild; echo "${COMPREPLY[@]}"\n'
        'COMP_WORDS=(coursebuild check --tru 1.2); _coursebuild; echo "${COMPREPLY[@]}"\n'
    )
    result = subprocess.run(
        [bash, "-c", code],
        cwd=course.root,
        env=course.environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout == "complete -o default -F _coursebuild coursebuild\n1.2\n--truth\n"
    for shell, line in (("zsh", "compdef _coursebuild coursebuild"), ("fish", "complete -c ")):
        assert line in course.main("completion", shell).out
