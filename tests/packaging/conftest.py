"""Fixtures for the packaging tests: copies of the project to build in, and a way to run things."""

import fcntl
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = ("node_modules", ".bundle*", "__pycache__")

Run = Callable[..., subprocess.CompletedProcess[str]]
Build = Callable[[Path, str], Path]


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def pyproject() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def full_name(pyproject: dict) -> str:
    """Name and version, as in the names of the built files and of the folders in them."""
    return f"{pyproject['project']['name']}-{pyproject['project']['version']}"


@pytest.fixture(scope="session")
def packages() -> Path:
    """The installed npm packages; the tests themselves never download any."""
    folder = ROOT / "site" / "node_modules"
    if not (folder / "esbuild" / "package.json").is_file():
        pytest.fail("site/node_modules is not installed: run python site/bundle.py packages")
    return folder


@pytest.fixture(scope="session")
def run() -> Run:
    def run_command(
        *command: object, cwd: Path, path: Path | str | None = None
    ) -> subprocess.CompletedProcess[str]:
        environment = dict(os.environ)
        if path is not None:
            environment["PATH"] = str(path)
        return subprocess.run(
            [str(part) for part in command],
            cwd=cwd,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=600,
        )

    return run_command


@pytest.fixture(scope="session")
def copy_project(pyproject: dict, packages: Path) -> Callable[..., Path]:
    """Copies what the source distribution is made of, with the installed npm packages linked in.

    The bundle of the browser's half is copied, too, unless it is to be made again.
    """
    names = pyproject["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]

    def copy(target: Path, *, bundled: bool) -> Path:
        ignored = shutil.ignore_patterns(*LEFT_OUT, *(() if bundled else ("dist",)))
        target.mkdir(parents=True)
        for name in [*names, "/pyproject.toml", "/.gitignore"]:
            source = ROOT / name.removeprefix("/")
            if source.is_dir():
                shutil.copytree(source, target / source.name, ignore=ignored)
            elif source.is_file():
                shutil.copy2(source, target / source.name)
        (target / "site" / "node_modules").symlink_to(packages)
        return target

    return copy


@pytest.fixture(scope="session")
def build(run: Run) -> Build:
    """Builds a "wheel" or an "sdist" of a project folder as pip would; returns its path."""

    def build_target(project: Path, target: str) -> Path:
        out = project / "built" / target
        result = run(
            sys.executable, "-m", "hatchling", "build", "-t", target, "-d", out, cwd=project
        )
        assert result.returncode == 0, result.stdout + result.stderr
        (package,) = out.iterdir()
        return package

    return build_target


@pytest.fixture(scope="session")
def built_project(shared: Path, copy_project: Callable[..., Path], build: Build) -> Path:
    """A copy of the project with its wheel and its source distribution in `built`.

    Shared by all processes of a run: the first process makes it, the others wait.
    """
    project = shared / "packaging" / "project"
    project.parent.mkdir(exist_ok=True)
    with (project.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (project.parent / "done").exists():
            shutil.rmtree(project, ignore_errors=True)
            copy_project(project, bundled=True)
            build(project, "wheel")
            build(project, "sdist")
            (project.parent / "done").touch()
    return project


@pytest.fixture(scope="session")
def wheel(built_project: Path) -> Path:
    (file,) = (built_project / "built" / "wheel").iterdir()
    return file


@pytest.fixture(scope="session")
def sdist(built_project: Path) -> Path:
    """The source distribution, made where site/dist and node_modules exist and must be left out."""
    assert (built_project / "site" / "dist").is_dir()
    (file,) = (built_project / "built" / "sdist").iterdir()
    return file
