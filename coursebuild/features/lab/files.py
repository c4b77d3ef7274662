"""The files that live labs need, and what pages show of their trials.

Entry point: `publish_labs(results, assets)`.

Every file has a hash of its content in its name, so that a browser may keep it for ever. Addresses
inside a lab's configuration are relative to it: all of its files lie in one folder.
"""

from __future__ import annotations

import json

from msgspec import Struct

from coursebuild.core.features import PublishedTrials
from coursebuild.core.model.results import LabResult, OutputFile, Results
from coursebuild.core.pages.assets import Assets, hashed_name

_FOLDER = "assets/labs"


class ShownRecord(Struct, frozen=True):
    """What a page shows of the trial of a lab."""

    picture: str
    """Site path."""
    size: tuple[int, int]
    """Pixels."""
    time: float
    """Simulated time of the picture, s."""
    readouts: tuple[tuple[str, str], ...]
    end: float
    """Simulated time of the readouts and of the end of the plots, s."""
    plots: tuple[str, ...]
    """SVG."""
    tried: int
    parity: str


class ShownLab(Struct, frozen=True):
    """A lab that runs."""

    name: str
    config: str
    """Site path, as of `script`."""
    script: str
    """The page's half of labs, shared by all."""
    record: ShownRecord | None


def publish_labs(results: Results, assets: Assets) -> PublishedTrials:
    """Name everything that the labs need; nothing where there are none."""
    if not results.labs:
        return PublishedTrials()
    files: dict[str, OutputFile] = {}

    def publish(name: str, data: bytes) -> str:
        path = hashed_name(f"{_FOLDER}/{name}", data)
        files[path] = OutputFile(path, data)
        return path

    script = publish("lab.js", assets.file("js/lab.js"))
    worker = publish("worker.js", assets.file("js/lab-worker.js"))
    wasm = publish("mujoco.wasm", assets.file("mujoco/mujoco.wasm"))
    shown = {}
    for lab in results.labs:
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
        picture = publish(f"{lab.name}.png", static.picture) if static is not None else ""
        address = publish(f"{lab.name}.json", text.encode())
        shown[lab.name] = ShownLab(lab.name, address, script, _record(lab, picture))
    return PublishedTrials(shown, tuple(files.values()))


def _record(lab: LabResult, picture: str) -> ShownRecord | None:
    static = lab.static
    if static is None:
        return None
    return ShownRecord(
        picture=picture,
        size=static.size,
        time=static.time,
        readouts=static.readouts,
        end=static.end,
        plots=static.plots,
        tried=len(lab.tried),
        parity=lab.parity,
    )
