"""A tool with other code, templates or libraries has another digest."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from coursebuild.core.engine import tool
from coursebuild.core.engine.tool import code_digest, package_versions


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


def install(site: Path, name: str, version: str, *needs: str, files: str = "") -> None:
    """Install a package as far as its metadata are concerned, in the place of another version."""
    for old in site.glob(f"{name}-*.dist-info"):
        shutil.rmtree(old)
    folder = site / f"{name}-{version}.dist-info"
    folder.mkdir(parents=True)
    lines = [f"Name: {name}\n", *(f"Requires-Dist: {need}\n" for need in needs)]
    text = "".join(lines) + "\nRequires-Dist: not-a-requirement\n"
    (folder / "METADATA").write_text(text)
    (folder / "RECORD").write_text(files)


def test_packages_count_that_the_tool_or_a_feature_needs(tmp_path: Path) -> None:
    site = tmp_path / "site-packages"
    path = (str(tmp_path / "nowhere"), str(site))
    tool_needs = ("Jinja2<4,>=3.1", "brotli ; extra == 'cache'", "Old_Name[fast] >= 2")
    install(site, "coursebuild", "0.1.0", *tool_needs)
    install(site, "jinja2", "3.1.6", "MarkupSafe>=2.0")
    install(site, "markupsafe", "3.0.4", "jinja2")
    install(site, "brotli", "1.2")
    install(site, "old_name", "2.0", 'quick; extra == "fast"', "slow; extra == 'test'")
    install(site, "quick", "1")
    install(site, "slow", "1")
    install(site, "mmdr", "0.4.0", "novasvg", files="mmdr/__init__.py,,\nre.py,,\n")
    install(site, "black", "26.1", files="black/__init__.py,,\nblackd.py,,\n")
    install(site, "mermaid_fences", "1.0", "mmdr==0.4.0")

    def versions(*names: str, modules: tuple[str, ...] = ()) -> list[str]:
        # A name of its own each time, so that nothing is remembered.
        marks.append(str(tmp_path / str(len(marks))))
        names_found = package_versions(frozenset(names), frozenset(modules), (*marks, *path))
        return [name.removesuffix(".dist-info") for name in names_found]

    marks: list[str] = []
    own_packages = [
        "coursebuild-0.1.0",
        "jinja2-3.1.6",
        "markupsafe-3.0.4",
        "old_name-2.0",
        "quick-1",
    ]
    assert versions("coursebuild") == own_packages
    install(site, "black", "26.2")
    assert versions("coursebuild") == own_packages
    install(site, "markupsafe", "3.0.5")
    assert versions("coursebuild") == [part.replace("3.0.4", "3.0.5") for part in own_packages]
    # Features of packages, and modules that those of a course import.
    mermaid = ["mermaid_fences-1.0", "mmdr-0.4.0", "novasvg"]
    assert versions("Mermaid.fences") == mermaid
    assert versions(modules=("mmdr", "re", "coursebuild")) == mermaid[1:]
    assert len(versions("not-installed")) == 10, "in doubt all count"


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
