"""Reports that nobody measured, on the model `box` and two hard cases."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.model.diet_findings import (
    PROVED_LABEL,
    DietReport,
    DietScenario,
    Finding,
    ModelPlace,
    Saving,
)
from coursebuild.core.model.measurements import SceneCard, SceneReport
from coursebuild.core.model.results import Reports
from support.bench_reports import MACHINE, awkward, swing
from support.bench_reports import case as case
from support.bench_reports import row as row
from support.bench_reports import run as run
from support.bench_reports import scenario as scenario
from support.bench_reports import scene as scene

CARD = SceneCard(possible=7, touched=2, mjcf=12_345, mjb=98_765_432, browser=151.0)


def box(card: SceneCard | None = CARD) -> SceneReport:
    scenarios = (swing(), replace(awkward(), name="awkward"))
    return replace(scene(*scenarios, model="box"), card=card)


def finding(kind: str = "sensor-unread", **overrides: object) -> Finding:
    fields: dict[str, object] = {
        "kind": kind,
        "message": "nothing reads <this> sensor",
        "places": (ModelPlace("tip", "mujoco/sensor/framepos", "models/box.xml", 3, 5),),
        "label": PROVED_LABEL,
        "difference": 0.0,
        "scenarios": ("swing",),
        "proof": "its value goes nowhere",
        "saving": Saving(1.07, 0.01, True, 120, 40),
        "edits": (),
        "fixable": True,
        "kept": "",
        "doubt": "",
        **overrides,
    }
    return Finding(**fields)


def diet(*findings: Finding) -> DietReport:
    return DietReport(
        model="box",
        digest="0" * 64,
        quick=False,
        machine=MACHINE,
        scenarios=(DietScenario("swing", "ok", ()),),
        findings=findings,
        tried=(),
        stale=(),
    )


def reports() -> Reports:
    kept_finding = finding(
        "geom-far", kept="it is the horizon", proof="", label="equal within tolerance"
    )
    fields = {"label": "the same in what was run", "doubt": "examples/a.py names <it>"}
    doubted = finding("site-unused", **fields)
    return Reports(
        {"box": box()},
        {"box": diet(finding(), kept_finding, doubted)},
        (case("spring", 5), case("other", 5, note=""), case("top", 3, errors=())),
    )
