"""The files that live labs need, and their names.

Entry point: `lab_files(results, assets)`.

Every file has a hash of its content in its name, so that a browser may keep it for ever. Addresses
inside a lab's configuration are relative to it: all of its files lie in one folder.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

from msgspec import Struct

from coursebuild.core.model.results import LabResult, OutputFile
from coursebuild.core.pages.assets import Assets, hashed_name

_FOLDER = "assets/labs"


class LabFiles(Struct, frozen=True):
    """Where the files of one lab are, as site paths."""

    result: LabResult
    config: str
    script: str
    """The page's half of labs, shared by all."""
    picture: str | None


class PublishedLabs(Struct, frozen=True):
    """All labs of a course."""

    labs: Mapping[tuple[str, int], LabFiles]
    """By path of the lesson and offset of the lab in it."""
    files: tuple[OutputFile, ...]


def lab_files(labs: tuple[LabResult, ...], assets: Assets) -> PublishedLabs:
    """Name everything that the labs need; nothing where there are none."""
    if not labs:
        return PublishedLabs({}, ())
    files: dict[str, OutputFile] = {}

    def publish(name: str, data: bytes) -> str:
        path = hashed_name(f"{_FOLDER}/{name}", data)
        files[path] = OutputFile(path, data)
        return path

    script = publish("lab.js", assets.file("js/lab.js"))
    worker = publish("worker.js", assets.file("js/lab-worker.js"))
    wasm = publish("mujoco.wasm", assets.file("mujoco/mujoco.wasm"))
    found = {}
    for lab in labs:
        data = json.loads(lab.config)
        # Labs of the same model share its file.
        parts = {
            "module": publish(f"{lab.name}.js", lab.module.encode()),
            "mjb": publish(f"{data.get('model') or lab.name}.mjb", lab.mjb),
            "worker": worker,
            "wasm": wasm,
        }
        addresses = {key: path.removeprefix(f"{_FOLDER}/") for key, path in parts.items()}
        config = {**data, **addresses}
        if lab.export is not None:
            name, text = lab.export
            config["exportPython"] = {"name": name, "text": text}
        text = json.dumps(config, ensure_ascii=False, separators=(",", ":"))
        static = lab.static
        picture = publish(f"{lab.name}.png", static.picture) if static is not None else None
        place = (lab.span.path, lab.span.start)
        found[place] = LabFiles(lab, publish(f"{lab.name}.json", text.encode()), script, picture)
    return PublishedLabs(found, tuple(files.values()))
