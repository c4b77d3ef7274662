"""The models of a course as labs and exercises use them: found, compiled once, with their files."""

from __future__ import annotations

from pathlib import Path

from coursebuild.api import Source, TrialContext
from coursebuild.core.files.read import read_bytes
from coursebuild.core.run.mjcf import model_files, model_key
from coursebuild.features.lab.engines.native import NativeEngine


def find_model(context: TrialContext, name: str) -> Source | None:
    """A model of the course by its name, if there is one that compiles."""
    compilation = context.models.get(name)
    if compilation is None or not compilation.facts:
        return None
    return next((m.source for m in context.course.models if m.name == name), None)


def save_model(context: TrialContext, native: NativeEngine, model: Source) -> bytes:
    """The MJB file of a model, made now or before; a `NativeError` if it cannot be."""
    store, key = context.run_store.store, model_key(context.root, model.path, model.text)
    mjb = store.get("mjb", key, bytes)
    if mjb is None:
        mjb = native.save(model.path, model.text)
        if model_key(context.root, model.path, model.text) == key:  # it was not edited meanwhile
            store.put("mjb", key, mjb)
    return mjb


def files_of(root: Path, model: Source) -> dict[str, bytes]:
    """A model and the files that it includes, by path."""
    paths = model_files(root, model.path, model.text)
    included = {path: read_bytes(root, path) for path in paths if (root / path).is_file()}
    return {model.path: model.text.encode(), **included}
