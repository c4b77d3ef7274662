"""Why an engine refuses what a lab's model asks for."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from coursebuild.api import Diagnostic, Excerpt, Source, Span, diagnose
from coursebuild.core.files.read import read_bytes
from coursebuild.core.run.mjcf import existing_files, read_tags
from coursebuild.features.lab.model import Lab

_NO_PLUGIN = "invalid plugin slot"
"""Part of what MuJoCo says."""
_PART_OF_MODEL = 20
"""Engine, model and states together take up to 16 times the memory of a large compiled model."""


def diagnose_refusal(lab: Lab, root: Path, model: Source, message: str) -> list[Diagnostic]:
    """The diagnostics of an engine's message about plugins of a model; none of another one."""
    if _NO_PLUGIN not in message:
        return []
    places: dict[str, Span] = {}
    for text in _model_texts(lab, root, model):
        for element in read_tags(text.text):
            for name, value, place in element.attributes:
                if (element.name, name) == ("plugin", "plugin"):
                    places.setdefault(value, text.span(*place))
    help = "leave the lab out, or write what the plugin does as the lab's controller"
    return [
        diagnose("lab-engine", place, f"the browser's engine has no plugin `{name}`", help=help)
        for name, place in places.items()
    ] or [diagnose("lab-engine", lab.place(()), "the browser's engine has no plugins", help=help)]


def diagnose_size(lab: Lab, mjb: bytes, memory: int) -> list[Diagnostic]:
    """The diagnostic of a compiled model that is too large to be tried in so many MiB."""
    size, largest = len(mjb) >> 20, memory // _PART_OF_MODEL
    if size <= largest:
        return []
    message = f"the model is too large: compiled, it has {size} MiB, and {largest} MiB can be tried"
    help = (
        "give it smaller meshes, textures and height fields, or set `memory` in `[limits]` of "
        f"the map: {_PART_OF_MODEL} times the size of the model"
    )
    return [diagnose("lab-engine", lab.place(("model",)), message, help=help)]


def _model_texts(lab: Lab, root: Path, model: Source) -> Iterator[Excerpt | Source]:
    """The text of a model, and those that it includes."""
    yield model if lab.xml is None else lab.xml
    for path in existing_files(root, model.path, model.text):
        if path.endswith(".xml") and not Path(path).is_absolute():
            yield Source(path, read_bytes(root, path).decode("utf-8", "replace"))
