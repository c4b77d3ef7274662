"""The colours of surfaces in the light of a lab, by the formulas of the live view.

Entry points: `shade(...)`, the colours of points of a surface; `light_of(scene, frame, forward)`,
the light of a lab's scene; `material_of(scene, index)`.

The live view (`lights.js` and `materials.js` of the page) draws with three.js's Blinn-Phong
material, set to match MuJoCo's renderer. The formulas here are the same, without shadows, which the
live view, too, leaves out if there is no graphics processor.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from coursebuild.features.lab.picture.shapes import Array, unit

_AMBIENT, _FRONT, _TOP = 0.35, 0.25, 0.6
"""Light of a model without lights: from all sides, from the camera, and most from above, so that no
two sides of a box look alike."""
LAMP = (0.25, -0.35, 0.9)
"""Direction of the light from above, which throws the shadows."""
_STUDIO_GLOSS = 0.5
"""Strength of highlights in a model without lights."""
_SPECULAR, _SHININESS = 0.5, 0.5
"""Defaults for a geom without a material."""
_DIELECTRIC, _ROOM, _SHARPEST = 0.04, 0.5, 1024.0
"""See `materials.js`."""
_SPOT, _DIRECTIONAL = 0, 1
"""mjtLightType."""
_LIGHT = 7
"""Numbers of a light in a frame."""
_SOFT = 8.0
"""Up to this exponent a spot light fades from its middle on."""


class PointLight(Struct, frozen=True):
    """A lamp with parallel rays, or at a point, in all directions or in a cone."""

    colour: Array
    """(3,), RGB."""
    direction: Array
    """(3,), of length 1: where it shines."""
    position: Array | None = None
    """(3,), m; `None` if its rays are parallel."""
    cone: tuple[float, float] | None = None
    """Cosines of the angles at which a cone ends, and at which it starts to fade."""


class Light(Struct, frozen=True):
    """All light of a scene."""

    ambient: Array
    """(3,), RGB, from all sides."""
    point_lights: tuple[PointLight, ...]
    gloss: float
    """Strength of highlights."""


class Material(Struct, frozen=True):
    """How a surface reflects light."""

    shininess: float = 128 * _SHININESS
    """Exponent of the highlight."""
    specular: float = _SPECULAR
    """Strength of the highlight; with `metallic` or `roughness`, the share that is reflected."""
    emission: float = 0.0
    metallic: float = 0.0
    physical: bool = False
    """Whether `metallic` or `roughness` is set."""
    reflectance: float = 0.0


def material_of(scene: dict[str, Any], index: int) -> Material:
    """Return a material of a scene; -1 is none."""
    if index < 0:
        return Material()
    record = scene["materials"][index]
    metallic, roughness = record["metallic"], record["roughness"]
    exponent = max(1.0, 128 * record["shininess"])
    emission, reflectance = record["emission"], record["reflectance"]
    if metallic < 0 and roughness < 0:
        return Material(exponent, record["specular"], emission, reflectance=reflectance)
    if roughness >= 0:
        exponent = min(_SHARPEST, max(1.0, 2 / max(roughness, 1e-3) ** 4 - 2))
    metallic = min(1.0, max(0.0, metallic))
    return Material(exponent, _DIELECTRIC, emission, metallic, True, reflectance)


def studio(forward: Array) -> Light:
    """Return the light of a model without lights, for a camera that looks along `forward`."""
    down = -np.array(LAMP) / np.linalg.norm(LAMP)
    point_lights = (PointLight(np.full(3, _FRONT), forward), PointLight(np.full(3, _TOP), down))
    return Light(np.full(3, _AMBIENT), point_lights, _STUDIO_GLOSS)


def light_of(scene: dict[str, Any], frame: Array, forward: Array) -> Light:
    """Return the light of a scene in a frame seen along `forward`, which has length 1."""
    lights, headlight = scene["lights"], scene["visual"]["headlight"]
    if not lights:
        return studio(forward)
    sources = [*lights, headlight] if headlight["active"] else lights
    start = scene["layout"]["lights"]
    rows = [frame[start + _LIGHT * i : start + _LIGHT * (i + 1)] for i in range(len(lights))]
    active = [(light, row) for light, row in zip(lights, rows, strict=True) if row[6] != 0]
    lamps = [_point_light(light, row) for light, row in active]
    if headlight["active"]:
        lamps.append(PointLight(np.array(headlight["diffuse"]), forward))
    diffuse = sum(sum(light["diffuse"]) for light in sources)
    specular = sum(sum(light["specular"]) for light in sources)
    gloss = min(2.0, specular / diffuse) if diffuse > 0 else 0.0
    ambient = np.sum([light["ambient"] for light in sources], axis=0)
    return Light(ambient, tuple(lamp for lamp in lamps if np.isfinite(lamp.direction).all()), gloss)


def _point_light(light: dict[str, Any], row: Array) -> PointLight:
    colour, position = np.array(light["diffuse"]), row[:3]
    length = float(np.linalg.norm(row[3:6]))
    direction = row[3:6] / (length if length > 0 else 1.0)
    if light["type"] == _DIRECTIONAL:
        return PointLight(colour, direction)
    if light["type"] != _SPOT or light["cutoff"] >= 90:
        return PointLight(colour, direction, position)
    angle = np.radians(light["cutoff"])
    bright = angle * (1 - min(1.0, _SOFT / max(_SOFT, light["exponent"])))
    return PointLight(colour, direction, position, (float(np.cos(angle)), float(np.cos(bright))))


def shade(
    light: Light, material: Material, colour: Array, texel: Array, samples: tuple[Array, ...]
) -> Array:
    """Compute the colours (n, 3) of points of a surface.

    `colour` is (3,), and a texture's `texel` (n, 3) or (1, 3) multiplies it; `samples` holds points
    (n, 3), m, normals (n, 3) and directions to the eye (n, 3), both of length 1.
    """
    points, normals, toward_eye = samples
    metallic = material.metallic
    matte = 1 - (1 - _ROOM) * metallic
    base = colour * matte * texel
    glow = colour * (material.emission + (1 - matte) * light.ambient) * texel
    exponent = material.shininess
    if material.physical:
        reflected_share = np.full(3, material.specular) * (1 - metallic) + metallic * colour
    else:
        reflected_share = np.full(3, 8 / (exponent + 2) * material.specular * light.gloss)
    total = glow + light.ambient * base + np.zeros((len(points), 1))
    for lamp in light.point_lights:
        back, strength = _rays(lamp, points)
        facing = np.clip(_dot(normals, back), 0.0, None) * strength
        half = unit(back + toward_eye)
        fresnel = np.exp2((-5.55473 * (vh := np.clip(_dot(toward_eye, half), 0, 1)) - 6.98316) * vh)
        peak = (exponent + 2) / 8 * np.clip(_dot(normals, half), 0.0, 1.0) ** exponent
        shine = (reflected_share * (1 - fresnel[:, None]) + fresnel[:, None]) * peak[:, None]
        total = total + lamp.colour * facing[:, None] * (base + shine)
    return total


def _rays(lamp: PointLight, points: Array) -> tuple[Array, Array]:
    """Return the directions from points to a lamp, and how much of its light reaches them."""
    if lamp.position is None:
        return -lamp.direction[None, :], np.ones(len(points))
    back = unit(lamp.position - points)
    if lamp.cone is None:
        return back, np.ones(len(points))
    edge, bright = lamp.cone
    share = np.clip((-back @ lamp.direction - edge) / max(bright - edge, 1e-9), 0.0, 1.0)
    return back, share * share * (3 - 2 * share)


def _dot(a: Array, b: Array) -> Array:
    product: Array = (a * b).sum(axis=-1)
    return product
