"""What comes with the tool, and the versions of what runs the scripts."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from coursebuild.core.files import resources
from coursebuild.core.files.errors import EffectError
from coursebuild.core.run import script_environment


@pytest.mark.parametrize("ask", [resources.assets_dir, resources.templates_dir])
def test_installed_before_source_tree_before_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ask: object
) -> None:
    package = tmp_path / "tree/coursebuild"
    monkeypatch.setattr(resources, "_PACKAGE", package)
    assert callable(ask)
    with pytest.raises(EffectError) as caught:
        ask()
    assert "make site" in caught.value.help
    for name in ("site/dist", "templates", "coursebuild/assets", "coursebuild/templates"):
        (tmp_path / "tree" / name).mkdir(parents=True)
        if name == "templates":
            assert ask().relative_to(tmp_path / "tree").as_posix() in ("site/dist", "templates")
    assert ask().parent == package


def test_bundle_and_templates_are_read_by_their_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path)
    for path in ("js/b.js", "js-a/a.js", "stamp.json", "a.css", "../templates/.a.html.swp"):
        (tmp_path / "assets" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "assets" / path).write_bytes(b"\xff\x00")
    (tmp_path / "templates").mkdir(exist_ok=True)
    (tmp_path / "templates/page.html").write_text("é\n")
    assert resources.template_texts() == (("page.html", "é\n"),)
    bundle = resources.Bundle()
    assert bundle["js/b.js"] == b"\xff\x00"
    for missing in ("js/c.js", "js", "a.css/b", "none/a.js"):
        with pytest.raises(KeyError):
            bundle[missing]
    # By the names of folders, as paths are sorted.
    assert list(bundle) == ["a.css", "js/b.js", "js-a/a.js"]
    assert len(bundle) == 3


def test_no_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", ["/nowhere"])
    script_environment.engine_version.cache_clear()
    try:
        assert script_environment.engine_version() == "none"
    finally:
        script_environment.engine_version.cache_clear()
