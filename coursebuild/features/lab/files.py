"""The files that live labs need, and what pages show of their trials.

Entry point: `publish_labs(results, assets)`.

Every file has a hash of its content in its name, so that a browser may cache it for ever. Addresses
inside a lab's configuration are relative to it: all of its files lie in one folder.
"""

from __future__ import annotations

import json
from typing import Any

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model.results import OutputFile, PublishedTrials, Results
from coursebuild.core.pages.assets import Assets, hashed_name
from coursebuild.features.lab.model import ODE, PLOT

_FOLDER = "assets/labs"


class LabRecord(Struct, frozen=True):
    """What a page shows of a lab on paper, without JavaScript, and before the lab starts."""

    size: tuple[int, int]
    """Width and height of the picture, pixels."""
    scale: tuple[float, float] | None
    """Length of the bar that shows the picture's scale: in m, and in pixels. `None` for a lab
    without an engine, whose picture is that of its plots."""
    time: float
    """Simulated time of the picture, s."""
    readouts: tuple[tuple[str, str], ...]
    """Labels and values at the end of the main run."""
    end: float
    """Simulated time of the readouts and of the end of the plots, s."""
    plots: tuple[Markup, ...]
    """One SVG element for each plot."""
    place: str = ""
    """Where on the axis the readouts were taken, for a lab without an engine."""


class LabOutput(Struct, frozen=True):
    """What a page needs to show and run a lab."""

    module: str
    """The lab's code as an ES module."""
    config: dict[str, Any]
    """The lab's data, as JSON has it."""
    mjb: bytes = b""
    """The model."""
    record: LabRecord | None = None
    picture: bytes = b""
    """PNG on a transparent ground, if there is a record; SVG of a lab without an engine."""
    script: tuple[str, str] | None = None
    """Name and text of a Python script that does the same; `{{control:N}}` in it stands for the
    value of control N."""


class PublishedLab(Struct, frozen=True):
    """A lab that pages can run."""

    name: str
    config: str
    """Site path, like `script`."""
    script: str
    """The script that runs on the page, the same for all labs."""
    record: LabRecord | None
    picture: str
    """Site path; empty if there is no record."""
    attempt_count: int
    parity: str


def publish_labs(results: Results, assets: Assets) -> PublishedTrials:
    """Publish everything that the labs need."""
    if not results.trials:
        return PublishedTrials()
    files: dict[str, OutputFile] = {}

    def publish(name: str, data: bytes) -> str:
        path = hashed_name(f"{_FOLDER}/{name}", data)
        files[path] = OutputFile(path, data)
        return path

    trials = [(t.line, t.output) for t in results.trials if isinstance(t.output, LabOutput)]
    kinds = {lab.config.get("kind") in (PLOT, ODE) for _, lab in trials}
    if True in kinds:
        equation_script = publish("equations.js", assets.file("js/equation-lab.js"))
    if False in kinds:
        lab_script = publish("lab.js", assets.file("js/lab.js"))
        worker = publish("worker.js", assets.file("js/lab-worker.js"))
        wasm = publish("mujoco.wasm", assets.file("mujoco/mujoco.wasm"))
    labs = {}
    for line, lab in trials:
        name = line.name
        if lab.config.get("kind") in (PLOT, ODE):
            data = {key: value for key, value in lab.config.items() if key not in _CLAIMS}
            picture = publish(f"{name}.svg", lab.picture) if lab.record is not None else ""
            address = publish(f"{name}.json", _json(data))
            labs[name] = PublishedLab(
                name, address, equation_script, lab.record, picture, line.tried, line.parity
            )
            continue
        is_editable, model = (
            "xml" in lab.config,
            lab.config.get("model") or name,
        )  # the page compiles the model, in a worker of its own
        # Labs of the same model share its file.
        parts = {
            "module": publish(f"{name}.js", lab.module.encode()),
            "mjb": "" if is_editable else publish(f"{model}.mjb", lab.mjb),
            "worker": f"{worker}#{name}" if is_editable else worker,
            "wasm": wasm,
        }
        addresses = {key: path.removeprefix(f"{_FOLDER}/") for key, path in parts.items()}
        config = lab.config | addresses
        if lab.script is not None:
            config["exportPython"] = dict(zip(("name", "text"), lab.script, strict=True))
        picture = publish(f"{name}.png", lab.picture) if lab.record is not None else ""
        address = publish(f"{name}.json", _json(config))
        labs[name] = PublishedLab(
            name, address, lab_script, lab.record, picture, line.tried, line.parity
        )
    return PublishedTrials(labs, tuple(files.values()))


_CLAIMS = ("expect", "verify")
"""Data of a lab without an engine that only its trial needs."""


def _json(data: dict[str, Any]) -> bytes:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":")).encode()
