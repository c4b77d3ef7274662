"""The static form of a lab: what its trial recorded, as a picture, plots and a table.

Entry points: `draw_picture(lab, main)`, `lab_record(lab, main)`; `png(pixels)`.
"""

from __future__ import annotations

import math
import struct
import zlib
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from coursebuild.core.drawing.scales import typeset_number
from coursebuild.features.lab.files import LabRecord
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.picture.draw import FreeCamera, draw
from coursebuild.features.lab.picture.light import light_of
from coursebuild.features.lab.picture.plots import plot_svg
from coursebuild.features.lab.picture.scenery import scene_solids
from coursebuild.features.lab.picture.studio import Floor, round_length
from coursebuild.features.lab.picture.textures import SKY, texture_of
from coursebuild.features.lab.reply import MainRun, unpack_arrays

_WIDTH = 640
_USUAL = 1.6
"""Width of a usual view over its height."""
_FROM_AFAR = 1000.0
_BAR = 0.2
"""The largest part of the picture's width that the scale bar takes."""
_LARGE = 1e9
"""From here on numbers are written with powers of ten, as in the live lab."""


def draw_picture(lab: Lab, main: MainRun) -> bytes:
    """Draw the start of the main run of a lab's trial, as PNG."""
    scene = unpack_arrays(main["scene"])
    frame = unpack_arrays(main["pictures"][0]["frame"])
    camera = _camera(lab, scene["camera"])
    light = light_of(scene, np.asarray(frame, dtype=float), camera.forward)
    skies = (texture_of(t) for t in scene["textures"] if t["type"] == SKY)
    solids = tuple(scene_solids(scene, frame))
    floor = None
    if scene["floor"] is not None and not scene["lights"]:
        floor = Floor(scene["floor"], camera.distance, camera.target)
    return png(draw(solids, camera, _size(lab), light, next(skies, None), floor))


def _camera(lab: Lab, record: dict[str, Any]) -> FreeCamera:
    distance, fovy = record["distance"], record["fovy"]
    if record["orthographic"]:  # its `fovy` is a length; from far away the view is the same
        distance *= _FROM_AFAR
        fovy = math.degrees(2 * math.atan(fovy / 2 / distance))
    else:  # a narrow picture shows the full width
        width, height = _size(lab)
        wider = max(1.0, _USUAL * height / width)
        fovy = math.degrees(2 * math.atan(wider * math.tan(math.radians(fovy) / 2)))
    target = tuple(record["target"])
    return FreeCamera(record["azimuth"], record["elevation"], distance, target, fovy)


def _scale(lab: Lab, camera: FreeCamera) -> tuple[float, float]:
    """Return a round length, m, and its length in the picture, pixels, at the camera's target."""
    width, height = _size(lab)
    metre = height / (2 * camera.distance * math.tan(math.radians(camera.fovy) / 2))
    length = round_length(_BAR * width / metre)
    return length, length * metre


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Write an RGBA picture as a PNG file, with the same bytes each time."""
    opaque = bool((pixels[..., 3] == 255).all())
    height, width = pixels.shape[:2]
    rows = pixels[..., : 3 if opaque else 4].reshape(height, -1)
    # Each row becomes its difference from the row above: PNG's filter 2.
    differences = np.diff(rows, axis=0, prepend=np.zeros_like(rows[:1]))
    filtered_rows = np.column_stack((np.full(height, 2, np.uint8), differences))
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if opaque else 6, 0, 0, 0)
    data = zlib.compress(filtered_rows.tobytes(), 9)
    file = b"\x89PNG\r\n\x1a\n"
    for chunk in (b"IHDR" + header, b"IDAT" + data, b"IEND"):
        file += struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
    return file


def _size(lab: Lab) -> tuple[int, int]:
    """Return the width and height of a lab's picture, pixels."""
    return (_WIDTH, max(160, min(round(_WIDTH * lab.fields.height / 480), 480)))


def lab_record(lab: Lab, main: MainRun) -> LabRecord:
    """Make the record of a lab from the main run of its trial."""
    first, last = main["pictures"][0], main["pictures"][-1]
    recorded = main["plots"]
    plots = tuple(
        Markup(plot_svg(plot, recorded["times"], traces, narrow=lab.fields.dock))
        for plot, traces in zip(lab.fields.plots, recorded["plots"], strict=True)
    )
    readouts = tuple(
        (readout.label, _format_value(value, readout.digits))
        for readout, value in zip(lab.fields.readouts, last["readouts"] or (), strict=False)
    )
    scale = _scale(lab, _camera(lab, main["scene"]["camera"]))
    return LabRecord(_size(lab), scale, first["time"], readouts, last["time"], plots)


def _format_value(value: Any, digits: int) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, int | float):
        return "\u2013"
    form = f".{max(2, digits)}e" if abs(value) >= _LARGE else f".{digits}f"
    return typeset_number(f"{value:{form}}")
