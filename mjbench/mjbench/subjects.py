"""What is measured: a model in a file, with what lies beside it, or one that a program makes."""

from __future__ import annotations

import atexit
import hashlib
import re
import runpy
import tempfile
from pathlib import Path

import mujoco

from mjbench.bench import Subject
from mjbench.loop import program_output


class UsageError(Exception):
    """The command cannot be done as it is given."""


def read_subject(file: Path) -> Subject:
    """A model file, with the declarations and the exact motion that lie beside it."""
    if not file.is_file():
        raise UsageError(f"there is no file {file}")
    if file.suffix == ".py":
        return _subject_of_python(file)
    folder, data = file.parent.resolve(), file.read_bytes()
    declarations, exact = file.with_suffix(".toml"), file.with_suffix(".exact.py")
    digest, parts = hashlib.sha256(data), 0
    for file_beside in (declarations, exact):
        if file_beside.is_file():
            digest.update(file_beside.read_bytes())
    for part in _dependencies(folder / file.name) if file.suffix == ".xml" else ():
        if part.exists() and not part.samefile(file):
            digest.update(part.read_bytes())
            parts += part.stat().st_size
    return Subject(
        folder=str(folder),
        path=file.name,
        mjcf="" if file.suffix == ".mjb" else _source(file, data),
        name=file.stem,
        digest=digest.hexdigest(),
        declarations_path=declarations.name if declarations.is_file() else "",
        declarations=declarations.read_text("utf-8") if declarations.is_file() else "",
        exact=exact.name if exact.is_file() else "",
        parts=parts,
        fair=True,
    )


def _source(file: Path, data: bytes) -> str:
    """The text of a model; in URDF, packages are the folders of their names beside it or above."""

    def folder(match: re.Match[str]) -> str:
        for parent in file.resolve().parents:
            if (parent / match[1]).is_dir():
                return f"{parent.as_posix()}/{match[1]}/"
        message = f"{file} takes files from the package `{match[1]}`, and no folder of that name"
        raise UsageError(f"{message} lies beside it or above it: put the package there")

    text = data.decode("utf-8", "surrogatepass")
    return re.sub(r"package://([^/\s\"'<>]+)/", folder, text) if file.suffix == ".urdf" else text


def _dependencies(file: Path) -> list[Path]:
    """The files that a MJCF pulls in; none where it cannot be read, which compiling it tells."""
    try:
        return [Path(path) for path in mujoco.mju_getXMLDependencies(str(file))]
    except mujoco.FatalError:
        return []


def _subject_of_python(file: Path) -> Subject:
    """The model that a program makes: its `spec` or `model`, or what a function so called gives."""
    try:
        with program_output():
            names = runpy.run_path(str(file))
            product = names.get("spec", names.get("model"))
            product = product() if callable(product) else product
        if isinstance(product, mujoco.MjSpec):
            product = product.compile()
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise UsageError(f"{file} fails: {reason}") from error
    if not isinstance(product, mujoco.MjModel):
        raise UsageError(f"{file} defines no `spec` or `model` of MuJoCo's")
    folder = tempfile.TemporaryDirectory(prefix="mjbench-")
    atexit.register(folder.cleanup)
    binary = Path(folder.name, f"{file.stem}.mjb")
    mujoco.mj_saveModel(product, str(binary))
    table = file.with_suffix(".toml")
    if table.is_file():
        binary.with_suffix(".toml").write_bytes(table.read_bytes())
    return read_subject(binary)
