"""Fixtures for the packaging tests: copies of the project to build in, and a way to run things."""

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = shutil.ignore_patterns("node_modules", "dist", ".bundle*", "__pycache__")

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def pyproject() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def full_name(pyproject: dict) -> str:
    """Name and version, as the built files and the folders in them are called."""
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
    """Runs a command in a folder and returns what it did; PATH can be replaced."""

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
            timeout=300,
        )

    return run_command


@pytest.fixture(scope="session")
def copy_project(pyproject: dict, packages: Path) -> Callable[[Path], Path]:
    """Copies what the source distribution is made of, with the installed npm packages linked in."""
    names = pyproject["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]

    def copy(target: Path) -> Path:
        target.mkdir(parents=True)
        for name in [*names, "/pyproject.toml", "/.gitignore"]:
            source = ROOT / name.removeprefix("/")
            if source.is_dir():
                shutil.copytree(source, target / source.name, ignore=LEFT_OUT)
            elif source.is_file():
                shutil.copy2(source, target / source.name)
        (target / "site" / "node_modules").symlink_to(packages)
        return target

    return copy


@pytest.fixture(scope="session")
def build(run: Run) -> Callable[[Path, str], Path]:
    """Builds a "wheel" or an "sdist" of a project folder as pip would; returns its path."""

    def build_target(project: Path, target: str) -> Path:
        out = project / "built" / target
        done = run(sys.executable, "-m", "hatchling", "build", "-t", target, "-d", out, cwd=project)
        assert done.returncode == 0, done.stdout + done.stderr
        (made,) = out.iterdir()
        return made

    return build_target
