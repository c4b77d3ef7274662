"""The static form of a lab: what its trial recorded, as a picture, plots and a table.

Entry points: `draw_picture(lab, main)`, `static_form(lab, main, picture)`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from coursebuild.labs.light import light_of
from coursebuild.labs.picture import Camera, draw
from coursebuild.labs.plots import plot_svg
from coursebuild.labs.png import png
from coursebuild.labs.reply import unpacked
from coursebuild.labs.scenery import scene_solids
from coursebuild.labs.textures import texture_of
from coursebuild.model import Lab
from coursebuild.results import StaticForm

_SKY = 2
"""mjtTexture."""
_WIDTH = 640
_FROM_AFAR = 1000.0
_LARGE = 1e9
"""From here on numbers are shown as powers of ten, as in the live lab."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def draw_picture(lab: Lab, main: dict[str, Any]) -> bytes:
    """The start of the main run of a lab's trial, as PNG."""
    scene = unpacked(main["scene"])
    frame = unpacked(main["pictures"][0]["frame"])
    camera = scene["camera"]
    distance, fovy = camera["distance"], camera["fovy"]
    if camera["orthographic"]:  # whose `fovy` is a length: the same seen from far away
        distance *= _FROM_AFAR
        fovy = math.degrees(2 * math.atan(fovy / 2 / distance))
    target = tuple(camera["target"])
    seen = Camera(camera["azimuth"], camera["elevation"], distance, target, fovy)
    light = light_of(scene, np.asarray(frame, dtype=float), seen.forward)
    skies = (texture_of(t) for t in scene["textures"] if t["type"] == _SKY)
    solids = tuple(scene_solids(scene, frame))
    return png(draw(solids, seen, _size(lab), light, next(skies, None)))


def _size(lab: Lab) -> tuple[int, int]:
    """Width and height of a lab's picture, pixels."""
    return (_WIDTH, max(160, min(round(_WIDTH * lab.height / 480), 480)))


def static_form(lab: Lab, main: dict[str, Any], picture: bytes) -> StaticForm:
    """The static form of a lab whose trial's main run is `main`."""
    first, last = main["pictures"][0], main["pictures"][-1]
    recorded = main["plots"]
    plots = tuple(
        plot_svg(plot, recorded["times"], traces, narrow=lab.dock)
        for plot, traces in zip(lab.plots, recorded["plots"], strict=True)
    )
    readouts = tuple(
        (readout.label, _shown(value, readout.digits))
        for readout, value in zip(lab.readouts, last["readouts"] or (), strict=False)
    )
    return StaticForm(picture, _size(lab), first["time"], readouts, last["time"], plots)


def _shown(value: Any, digits: int) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, int | float):
        return "\u2013"
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else "\u221e" if value > 0 else "\u2212\u221e"
    if abs(value) >= _LARGE:
        mantissa, exponent = f"{value:.{max(2, digits)}e}".split("e")
        return f"{mantissa}·10{str(int(exponent)).translate(_RAISED)}".replace("-", "\u2212")
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\u2212")
