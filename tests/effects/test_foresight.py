"""Guessing whether scripts will run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from coursebuild.effects.foresight import early_server, likely_packages
from coursebuild.effects.store import Store
from coursebuild.results import Outcome, ScriptJob

CODE = "import mujoco\nimport numpy as np\nprint(np.pi)\n"


def text(code: str = CODE, info: str = "python file=examples/a.py", fence: str = "```") -> str:
    return f"# A lesson\n\nWords.\n\n{fence}{info}\n{code}{fence}\n\nOutput:\n\n```text\n3\n```\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "content/lessons").mkdir(parents=True)
    (tmp_path / "examples").mkdir()
    return tmp_path


def write(root: Path, text: str, name: str = "1.1-a.md") -> None:
    (root / "content/lessons" / name).write_bytes(text.encode())


def known(root: Path) -> Store:
    """A store in which there are results."""
    (root / ".coursebuild/scripts").mkdir(parents=True, exist_ok=True)
    (root / ".coursebuild/scripts/some").write_bytes(b"")
    return Store(root)


@pytest.mark.parametrize("fence", ["```", "````", "~~~"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_where_nothing_is_known_any_script_will_run(root: Path, fence: str, end: str) -> None:
    assert likely_packages(root, Store(root)) is None
    write(root, text(fence=fence).replace("\n", end))
    assert likely_packages(root, Store(root)) == ("numpy", "mujoco")
    known(root)
    (root / "examples/a.py").write_text(CODE)
    assert likely_packages(root, Store(root, fresh=True)) == ("numpy", "mujoco")
    assert likely_packages(root, Store(root)) is None


@pytest.mark.parametrize(
    ("code", "packages"),
    [
        ("print(1)\n", ()),
        ("import numpy\n", ("numpy",)),
        ("from mjcourse import spatial\n", ("numpy",)),
        ("import numpy as np\nnp.random.default_rng(1)\n", ("numpy", "numpy.random")),
        ("import json, mujoco\n", ("numpy", "mujoco")),
        ("", ()),
    ],
)
def test_what_they_import(root: Path, code: str, packages: tuple[str, ...]) -> None:
    write(root, text(code))
    assert likely_packages(root, Store(root)) == packages


@pytest.mark.parametrize(
    "lesson",
    [
        "# Nothing\n",
        "",
        text(info="python"),
        text(info="python file=examples/a.py norun"),
        text(info="python file=elsewhere.py"),
        text(info="pythonic file=examples/a.py"),
        text(info="text"),
        f"`````markdown\n{text()}`````\n",
        "```python file=examples/a.py",
        "```python file=examples/a.py\nno end",
    ],
)
def test_where_there_is_no_script_none_will_run(root: Path, lesson: str) -> None:
    write(root, lesson)
    assert likely_packages(root, Store(root)) is None


def test_a_script_that_was_changed_will_run(root: Path) -> None:
    store = known(root)
    for i in range(9):
        write(root, text(info=f"python file=examples/{i}.py"), f"1.{i}-a.md")
        (root / f"examples/{i}.py").write_text(CODE)
    assert likely_packages(root, store) is None
    path = root / "content/lessons/1.5-a.md"
    path.write_text(path.read_text().replace("import mujoco\n", ""))
    assert likely_packages(root, store) == ("numpy",)
    path.write_text(text(info="python file=examples/5.py") + "More words.\n")
    assert likely_packages(root, store) is None
    (root / "examples/5.py").unlink()
    assert likely_packages(root, store) == ("numpy", "mujoco")


def test_any_bytes(root: Path) -> None:
    (root / "content/lessons/1.1-a.md").write_bytes(b"```python file=examples/\xff.py\n\xff\n```\n")
    (root / "content/lessons/1.2-b.md").mkdir()
    (root / "content/lessons/1.3-c.md").symlink_to("nowhere")
    os.mkfifo(root / "content/lessons/1.4-d.md")
    write(root, text(), "1.5-e.md")
    assert likely_packages(root, Store(root)) == ("numpy", "mujoco")
    os.mkfifo(root / "examples/a.py")
    assert likely_packages(root, known(root)) == ("numpy", "mujoco")
    (root / "content/lessons/1.5-e.md").unlink()
    assert likely_packages(root, Store(root)) is None


def test_they_are_run_by_what_was_begun(root: Path) -> None:
    write(root, text("print(6 * 7)\n"))
    (root / "examples/a.py").write_text("print(6 * 7)\n")
    job = ScriptJob("examples/a.py", (), 20.0, (), norun=False)
    with early_server(root, Store(root)) as run_all:
        assert run_all is not None
        [run] = run_all(root, [job], parallel=2)
        assert (run.outcome, run.stdout) == (Outcome.OK, "42\n")
    with early_server(root, known(root)) as run_all:
        assert run_all is None
