"""Versions: of installed distributions and modules, and those that `check --against` accepts."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import UsageError
from coursebuild.core.run.environments import check_other_version
from coursebuild.core.run.script_environment import ABSENT, InstalledPackages, engine_version


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder of installed packages."""
    folder = tmp_path / "site-packages"
    folder.mkdir()
    install(folder, "Some-Tool", "1.2", ["tool/__init__.py", "tool/part.py", "single.py"])
    install(folder, "native", "3.0rc1", ["_fast.cpython-311-x86_64-linux-gnu.so", "space/a/x.py"])
    install(folder, "other", "4", ["space/b/x.py"])
    return folder


def install(folder: Path, name: str, version: str, files: list[str]) -> None:
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "RECORD").write_text("".join(f"{file},,\n" for file in [*files, f"{info.name}/RECORD"]))
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(f"# {name} {version}\n")


def ask(tmp_path: Path, site: Path) -> InstalledPackages:
    return InstalledPackages(Store(tmp_path), [str(site)])


def test_versions(tmp_path: Path, site: Path) -> None:
    packages = ask(tmp_path, site)
    assert packages.version("tool") == packages.version("single") == "Some-Tool 1.2"
    assert packages.version("_fast") == "native 3.0rc1"
    assert packages.version("space") == "native 3.0rc1, other 4"
    assert packages.version("nothing") == ABSENT
    assert packages.version("no.such..name") == ABSENT


def test_a_module_that_no_distribution_names_is_known_by_its_files(
    tmp_path: Path, site: Path
) -> None:
    (site / "loose.py").write_text("a = 1\n")
    (site / "folder").mkdir()
    (site / "folder/__init__.py").write_text("")
    (site / "folder/data.bin").write_bytes(b"1")
    first = ask(tmp_path, site)
    before = first.version("loose"), first.version("folder")
    library = first.version("mjcourse")  # ours; its version does not change while it is developed
    assert all(version.startswith("files ") for version in (*before, library))
    (site / "folder/__pycache__").mkdir()
    (site / "folder/__pycache__/x.pyc").write_bytes(b"1")
    assert ask(tmp_path, site).version("folder") == before[1]
    (site / "loose.py").write_text("a = 2\n")
    (site / "folder/data.bin").write_bytes(b"2")
    second = ask(tmp_path, site)
    assert second.version("loose") != before[0]
    assert second.version("folder") != before[1]


def test_the_map_is_kept_until_something_is_installed(tmp_path: Path, site: Path) -> None:
    assert ask(tmp_path, site).version("tool") == "Some-Tool 1.2"
    (site / "Some_Tool-1.2.dist-info/METADATA").write_text(
        "Metadata-Version: 2.1\nName: Some-Tool\nVersion: 1.3\n"
    )
    assert ask(tmp_path, site).version("tool") == "Some-Tool 1.2"
    (site / "Some_Tool-1.2.dist-info").rename(site / "Some_Tool-1.3.dist-info")
    assert ask(tmp_path, site).version("tool") == "Some-Tool 1.3"


def test_the_first_on_the_path_counts(tmp_path: Path, site: Path) -> None:
    user = tmp_path / "user/site-packages"
    user.mkdir(parents=True)
    install(user, "Some-Tool", "9", ["tool/__init__.py"])
    packages = InstalledPackages(Store(tmp_path), [str(user), str(site), str(tmp_path / "none")])
    assert packages.version("tool") == "Some-Tool 9"


@pytest.mark.parametrize(
    "text", ["", "abc", "3..1", "v3.1", "3.1 ", "==3.1", "3.1; x", "-e", "٣.١"]
)
def test_texts_that_are_no_version(text: str) -> None:
    with pytest.raises(UsageError) as error:
        check_other_version(text)
    assert str(error.value) == f"--against: {text!r} is not a version of MuJoCo, such as 3.13.0"


def test_the_installed_version_is_refused_however_it_is_written() -> None:
    installed = engine_version()
    for text in (installed, f"{installed}.0"):
        with pytest.raises(UsageError) as error:
            check_other_version(text)
        assert str(error.value) == f"--against: MuJoCo {installed} is the version installed here"
    assert check_other_version("3.99") == "3.99"
