"""With `--sandbox`, a lab's code runs as Python in the sandbox alone, each lab's in its own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from support.fixture_cases import fixture_text
from support.lab_lessons import course, fence
from support.sandboxes import require_sandbox

pytestmark = pytest.mark.engine

SCRIPT = fixture_text("scripts/lab_in_short.txt")
"""What a script of a lab defines, in short."""
FORGERY = """import os; os.write(3, b'{"error": "", "start": "forged"}\\n'); os._exit(0)"""
"""Answers in the place of the child."""
CHILDREN = fixture_text("scripts/children.txt")
FILE = """file = open("/many", "wb")
    while True: file.write(bytes(1 << 20))"""


@pytest.fixture
def native(tmp_path: Path) -> Iterator[NativeEngine]:
    (tmp_path / "course").mkdir()
    sandbox = require_sandbox(tmp_path)
    with NativeEngine(tmp_path / "course", 1.0, 300, sandbox=sandbox) as native:
        yield native


def request(root: Path, code: str = "pass", value: str = "1") -> dict[str, Any]:
    text = SCRIPT.format(code=code, value=value)
    path = str(root / "course/examples/x.py")
    return {"path": path, "text": text, "buttons": [], "variants": [], "near": 0}


def test_script_of_a_lab_sees_and_writes_nothing_outside(
    native: NativeEngine, tmp_path: Path
) -> None:
    (tmp_path / "secret").write_text("hush")
    reply = native.script(request(tmp_path, value=f"open({str(tmp_path / 'secret')!r}).read()"))
    assert "No such file or directory" in reply.failure
    for place in (tmp_path, tmp_path / "course"):
        native.script(request(tmp_path, f"open({str(place / 'ran')!r}, 'w')"))
        assert not (place / "ran").exists()
    reply = native.script(
        request(tmp_path, value="'COURSEBUILD_STORE_KEY' in __import__('os').environ")
    )
    assert reply.start == (("answer", 0.0),)


def test_script_that_answers_for_its_child_falsifies_no_other_result(
    native: NativeEngine, tmp_path: Path
) -> None:
    forged = native.script(request(tmp_path, FORGERY))
    assert "its report is none" in forged.failure
    assert native.script(request(tmp_path, value="42")).start == (("answer", 42.0),)
    patch = "import json; json.dumps = lambda _: '[' * 100_000"
    with pytest.raises(NativeError, match="gave no answer that can be read"):
        native.script(request(tmp_path, patch))
    assert native.script(request(tmp_path, value="43")).start == (("answer", 43.0),)


def test_limits_hold_for_a_script_of_a_lab_and_what_it_starts(
    native: NativeEngine, tmp_path: Path
) -> None:
    with pytest.raises(NativeError, match="took more than 300 MiB of memory"):
        native.script(request(tmp_path, CHILDREN))
    assert "No space left" in native.script(request(tmp_path, FILE)).failure
    assert "MemoryError" in native.script(request(tmp_path, "bytes(400 << 20)")).failure
    endless = "import signal; signal.setitimer(signal.ITIMER_PROF, 0.5)\n    while True: pass"
    # A limit of processor time that a script has lifted is waited for ten times.
    with (
        NativeEngine(tmp_path / "course", 0.3, 300, sandbox=require_sandbox(tmp_path)) as hurried,
        pytest.raises(NativeError, match=r"took longer than 0\.3 s"),
    ):
        hurried.script(request(tmp_path, endless))


@pytest.mark.parametrize("option", [(), ("--sandbox",)])
def test_trying_a_lab_imports_nothing_from_the_course(
    tmp_path: Path, stores: Path, option: tuple[str, ...]
) -> None:
    lab = fence('{"model": "ball", "verify": {"seconds": 0.2}}')
    folder = course(tmp_path / "course", stores, "## Lab\n\n" + lab)
    require_sandbox(folder.root)
    marks = tmp_path / "marks"
    marks.mkdir()
    for module in ("ctypes", "mujoco", "numpy", "glfw", "sitecustomize", "mjcourse"):
        folder.write(f"{module}.py", f"open({str(marks / module)!r}, 'w')\n")
    folder.run("build", *option).require_success()
    (offer,) = folder.root.glob("public/assets/labs/1.2-lab-1.*.json")
    assert "mujoco" in json.loads(offer.read_text())["exportPython"]["text"]
    assert list(marks.iterdir()) == []
