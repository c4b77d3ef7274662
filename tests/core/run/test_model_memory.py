"""Compiled models that are remembered: MuJoCo starts if and only if something changed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from coursebuild.core.engine.memo import Memo
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run import mjcf
from coursebuild.core.run.model_memory import compile_kept
from support.model_files import TETRAHEDRON

pytestmark = pytest.mark.site

MAIN = """<mujoco><compiler meshdir="assets"/><include file="part.xml"/>
<asset><mesh name="m" file="m.obj"/></asset>
<worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>"""
PART = '<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>'


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    (root / "models/assets").mkdir(parents=True)
    (root / "models/assets/m.obj").write_text(TETRAHEDRON)
    (root / "models/part.xml").write_text(PART)
    (root / "models/main.xml").write_text(MAIN)
    return root


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What MuJoCo is asked to compile: names of models, and texts."""
    asked: list[str] = []
    real = mjcf.compile_all

    def compile(root: Path, texts: list[tuple[str, str]], **limits: int) -> object:
        asked.extend(text if path == mjcf.TEXT_PATH else Path(path).stem for path, text in texts)
        return real(root, texts, **limits)

    monkeypatch.setattr(mjcf, "compile_all", compile)
    return asked


def run(
    root: Path, texts: tuple[str, ...] = (), *, fresh: bool = False
) -> dict[str, CompileResult]:
    found = {path.stem: path.read_text() for path in sorted((root / "models").glob("*.xml"))}
    given = [(f"models/{name}.xml", text) for name, text in found.items()]
    given += [(mjcf.TEXT_PATH, text) for text in texts]
    results = compile_kept(root, Memo(root, fresh=fresh), given)
    return dict(zip([*found, *texts], results, strict=True))


def test_nothing_is_compiled_twice(root: Path, compiled: list[str]) -> None:
    text = '<mujoco><include file="part.xml"/></mujoco>'
    broken = "<mujoco><nonsense/></mujoco>"
    first = run(root, (text, broken, text))
    assert sorted(compiled) == sorted(["main", "part", text, broken])
    assert first["main"].facts is not None and first["main"].facts.includes == (
        "models/assets/m.obj",
        "models/part.xml",
    )
    assert first[broken].error
    compiled.clear()
    for path in root.rglob("*"):
        os.utime(path)
    assert run(root, (broken, text)) == {k: first[k] for k in ("main", "part", broken, text)}
    assert compiled == []
    moved = root.rename(root.with_name("moved"))
    assert run(moved) == {name: first[name] for name in ("main", "part")}
    assert compiled == []


def test_what_is_made_of_a_file_is_compiled_again(root: Path, compiled: list[str]) -> None:
    run(root)
    for file, again in (
        ("models/assets/m.obj", ["main"]),
        ("models/part.xml", ["main", "part"]),
        ("models/main.xml", ["main"]),
        ("models/other.txt", []),
    ):
        compiled.clear()
        path = root / file
        path.write_text((path.read_text() if path.exists() else "") + "\n")
        run(root)
        assert compiled == again, file
    compiled.clear()
    run(root, fresh=True)
    assert compiled == ["main", "part"]


def test_an_error_is_remembered_until_the_missing_file_is_there(
    root: Path, compiled: list[str]
) -> None:
    (root / "models/assets/m.obj").unlink()
    first = run(root)
    assert "m.obj" in first["main"].error
    compiled.clear()
    assert run(root) == first
    assert compiled == []
    (root / "models/assets/m.obj").write_text(TETRAHEDRON)
    whole = run(root)
    assert whole["main"].error == ""
    assert compiled == ["main"]
    for path in (root / ".coursebuild/models").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes()[:-1])
    compiled.clear()
    assert run(root) == whole
    assert compiled == ["main", "part"], "what was kept is damaged"
