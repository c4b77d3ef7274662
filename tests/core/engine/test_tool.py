"""A tool with other code, templates or libraries has another digest."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from coursebuild.core.engine import tool
from coursebuild.core.engine.tool import code_digest


def fill(folder: Path) -> Path:
    (folder / "inner").mkdir(parents=True)
    for name in ("a.py", "inner/b.html"):
        (folder / name).write_text("x")
        os.utime(folder / name, ns=(1, 1))
    return folder


def test_it_depends_on_every_file_and_not_on_their_place(tmp_path: Path) -> None:
    folder, second = fill(tmp_path / "one"), fill(tmp_path / "two")
    names = {tool._digest(str(folder))}
    (second / "__pycache__").mkdir()
    (second / "__pycache__" / "a.pyc").write_text("x")
    assert names == {tool._digest(str(second))}
    os.utime(folder / "inner" / "b.html", ns=(2, 2))
    names.add(tool._digest(str(folder)))
    (folder / "a.py").write_text("xy")
    os.utime(folder / "a.py", ns=(1, 1))
    names.add(tool._digest(str(folder)))
    (folder / "c.py").write_text("")
    names.add(tool._digest(str(folder)))
    (folder / "a.py").unlink()
    names.add(tool._digest(str(folder)))
    assert len(names) == 5


def test_it_depends_on_what_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = fill(tmp_path / "one")
    site = tmp_path / "site-packages"
    (site / "Jinja2-3.1.6.dist-info").mkdir(parents=True)
    monkeypatch.setattr(sys, "path", [str(tmp_path / "nowhere"), str(site)])

    def name() -> str:
        tool._installed_packages.cache_clear()
        return tool._digest(str(folder))

    try:
        first = name()
        (site / "jinja2").mkdir()
        assert name() == first
        (site / "Jinja2-3.1.6.dist-info").rename(site / "jinja2-3.1.7.dist-info")
        assert name() != first
    finally:
        tool._installed_packages.cache_clear()


def test_content_counts_and_times_do_not(tmp_path: Path) -> None:
    (tmp_path / "part" / "inner").mkdir(parents=True)
    module, file = tmp_path / "part" / "inner" / "a.py", tmp_path / "other.py"
    module.write_text("x = 1\n")
    file.write_text("y = 1\n")
    first = code_digest("part", root=tmp_path)
    module.touch()
    file.write_text("y = 2\n")
    assert code_digest("part", root=tmp_path) == first
    digest = code_digest("part", "other.py", root=tmp_path)
    file.write_text("y = 3\n")
    assert code_digest("part", "other.py", root=tmp_path) != digest
    module.rename(tmp_path / "part" / "a.py")
    assert code_digest("part", root=tmp_path) != first
