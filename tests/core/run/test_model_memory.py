"""Compiled models are remembered: MuJoCo starts if and only if something changed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from coursebuild.core.engine.store import Store
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run import mjcf
from support.model_files import TETRAHEDRON

pytestmark = pytest.mark.site

MAIN = """<mujoco><compiler meshdir="assets"/><include file="part.xml"/>
<asset><mesh name="m" file="m.obj"/></asset>
<worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>"""
PART = '<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>'
TEXT = '<mujoco><include file="part.xml"/></mujoco>'
BROKEN = "<mujoco><nonsense/></mujoco>"


class Course:
    """A course of two models, and commands that compile them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.compiled_names: list[str] = []
        """What MuJoCo was asked to compile since the last `take_compiled`."""

    def compile(self, *extra_texts: str, fresh: bool = False) -> dict[str, CompileResult]:
        """The results, by the name of the model or by the text."""
        models = {path.stem: path.read_text() for path in sorted(self.root.glob("models/*.xml"))}
        texts = [(f"models/{name}.xml", text) for name, text in models.items()]
        texts += [(mjcf.TEXT_PATH, text) for text in extra_texts]
        results = mjcf.compile_or_recall(self.root, Store(self.root, fresh=fresh), texts)
        return dict(zip([*models, *extra_texts], results, strict=True))

    def take_compiled(self) -> list[str]:
        names, self.compiled_names = self.compiled_names, []
        return sorted(names)


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    course = Course(tmp_path / "course")
    (course.root / "models/assets").mkdir(parents=True)
    for path, text in {"assets/m.obj": TETRAHEDRON, "part.xml": PART, "main.xml": MAIN}.items():
        (course.root / "models" / path).write_text(text)
    real = mjcf.compile_all

    def compile(root: Path, texts: Sequence[tuple[str, str]], **limits: int) -> object:
        course.compiled_names += [
            t if path == mjcf.TEXT_PATH else Path(path).stem for path, t in texts
        ]
        return real(root, texts, **limits)

    monkeypatch.setattr(mjcf, "compile_all", compile)
    return course


def test_nothing_is_compiled_twice(course: Course) -> None:
    first = course.compile(TEXT, BROKEN, TEXT)
    assert course.take_compiled() == sorted(["main", "part", TEXT, BROKEN])
    assert first["main"].facts is not None and first["main"].facts.includes == (
        "models/assets/m.obj",
        "models/part.xml",
    )
    assert first[BROKEN].error
    for path in course.root.rglob("*"):
        os.utime(path)
    course.root = course.root.rename(course.root.with_name("moved"))
    assert course.compile(BROKEN, TEXT) == first
    assert course.take_compiled() == []


def test_models_are_compiled_again_when_a_file_of_theirs_changes(course: Course) -> None:
    course.compile()
    for file, again in (
        ("models/assets/m.obj", ["main"]),
        ("models/part.xml", ["main", "part"]),
        ("models/main.xml", ["main"]),
        ("models/other.txt", []),
    ):
        course.take_compiled()
        with (course.root / file).open("a") as stream:
            stream.write("\n")
        course.compile()
        assert course.take_compiled() == again, file
    course.compile(fresh=True)
    assert course.take_compiled() == ["main", "part"]


def test_an_error_is_remembered_until_the_missing_file_is_there(course: Course) -> None:
    mesh = course.root / "models/assets/m.obj"
    mesh.unlink()
    first = course.compile()
    assert "m.obj" in first["main"].error
    course.take_compiled()
    assert course.compile() == first
    assert course.take_compiled() == []
    mesh.write_text(TETRAHEDRON)
    assert course.compile()["main"].error == ""
    assert course.take_compiled() == ["main"]
