"""How surfaces look in the light of a lab: by the law of the live view.

Entry points: `shaded(...)`, the colours of points of a surface; `light_of(scene, frame, forward)`,
the light of a lab's scene; `material_of(scene, index)`.

The live view (`lights.js` and `materials.js` of the page) draws with three.js's Blinn-Phong
material, set so that it gives what MuJoCo's renderer gives. The formulas here are those, without
shadows, which the live view leaves out, too, where there is no graphics processor.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from coursebuild.features.lab.picture.shapes import Array, unit

_AMBIENT, _FRONT, _ABOVE = 0.35, 0.25, 0.6
"""A model without lights: light from all sides, from the camera, and from above, where most comes
from, so that no two sides of a box look alike."""
_FROM_ABOVE = (0.25, -0.35, 0.9)
_WITHOUT_LIGHTS = 0.5
"""How strong highlights are there."""
_SPECULAR, _SHININESS = 0.5, 0.5
"""Of a geom without a material."""
_DIELECTRIC, _ROOM, _SHARPEST = 0.04, 0.5, 1024.0
"""See `materials.js`."""
_SPOT, _DIRECTIONAL = 0, 1
"""mjtLightType."""
_LIGHT = 7
"""Floats of a light in a frame."""
_SOFT = 8.0
"""The exponent up to which a spot light is soft from its middle on."""


class PointLight(Struct, frozen=True):
    """A light: of parallel rays, of a point, or of a cone."""

    colour: Array
    """(3,), RGB."""
    direction: Array
    """(3,), of length 1: where it shines."""
    position: Array | None = None
    """(3,), m; `None` where its rays are parallel."""
    cone: tuple[float, float] | None = None
    """Cosines at which a cone ends and from which on it is bright."""


class Light(Struct, frozen=True):
    """All light of a scene."""

    ambient: Array
    """(3,), RGB, from all sides."""
    point_lights: tuple[PointLight, ...]
    gloss: float
    """How strong highlights are."""


class Material(Struct, frozen=True):
    """How a surface takes light."""

    shininess: float = 128 * _SHININESS
    """Exponent of the highlight."""
    specular: float = _SPECULAR
    """Strength of the highlight; of one with `metallic` or `roughness`, what it mirrors."""
    emission: float = 0.0
    metallic: float = 0.0
    physical: bool = False
    """Whether `metallic` or `roughness` is set."""
    reflectance: float = 0.0


def material_of(scene: dict[str, Any], index: int) -> Material:
    """A material of a scene; -1 is none."""
    if index < 0:
        return Material()
    given = scene["materials"][index]
    metallic, roughness = given["metallic"], given["roughness"]
    exponent = max(1.0, 128 * given["shininess"])
    emission, reflectance = given["emission"], given["reflectance"]
    if metallic < 0 and roughness < 0:
        return Material(exponent, given["specular"], emission, reflectance=reflectance)
    if roughness >= 0:
        exponent = min(_SHARPEST, max(1.0, 2 / max(roughness, 1e-3) ** 4 - 2))
    metallic = min(1.0, max(0.0, metallic))
    return Material(exponent, _DIELECTRIC, emission, metallic, True, reflectance)


def studio(forward: Array) -> Light:
    """The light of a model without lights, for a camera that looks along `forward`."""
    above = -np.array(_FROM_ABOVE) / np.linalg.norm(_FROM_ABOVE)
    point_lights = (PointLight(np.full(3, _FRONT), forward), PointLight(np.full(3, _ABOVE), above))
    return Light(np.full(3, _AMBIENT), point_lights, _WITHOUT_LIGHTS)


def light_of(scene: dict[str, Any], frame: Array, forward: Array) -> Light:
    """The light of a scene in a frame that is seen along `forward` (of length 1)."""
    lights, headlight = scene["lights"], scene["visual"]["headlight"]
    if not lights:
        return studio(forward)
    shining = [*lights, headlight] if headlight["active"] else lights
    start = scene["layout"]["lights"]
    rows = [frame[start + _LIGHT * i : start + _LIGHT * (i + 1)] for i in range(len(lights))]
    own = [_point_light(light, row) for light, row in zip(lights, rows, strict=True) if row[6] != 0]
    if headlight["active"]:
        own.append(PointLight(np.array(headlight["diffuse"]), forward))
    diffuse = sum(sum(light["diffuse"]) for light in shining)
    specular = sum(sum(light["specular"]) for light in shining)
    gloss = min(2.0, specular / diffuse) if diffuse > 0 else 0.0
    ambient = np.sum([light["ambient"] for light in shining], axis=0)
    return Light(ambient, tuple(lamp for lamp in own if np.isfinite(lamp.direction).all()), gloss)


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


def shaded(
    light: Light, material: Material, colour: Array, texel: Array, where: tuple[Array, Array, Array]
) -> Array:
    """Colours (n, 3) of points of a surface.

    `colour` is (3,), `texel` (n, 3) or (1, 3) what a texture makes of it; `where` holds points
    (n, 3), m, normals (n, 3) and the directions to the eye (n, 3), both of length 1.
    """
    points, normals, toward = where
    metallic = material.metallic
    matte = 1 - (1 - _ROOM) * metallic
    base = colour * matte * texel
    emitted = colour * (material.emission + (1 - matte) * light.ambient) * texel
    exponent = material.shininess
    if material.physical:
        mirrored = np.full(3, material.specular) * (1 - metallic) + metallic * colour
    else:
        mirrored = np.full(3, 8 / (exponent + 2) * material.specular * light.gloss)
    total = emitted + light.ambient * base + np.zeros((len(points), 1))
    for lamp in light.point_lights:
        back, strength = _rays(lamp, points)
        facing = np.clip(_dot(normals, back), 0.0, None) * strength
        half = unit(back + toward)
        fresnel = np.exp2((-5.55473 * (vh := np.clip(_dot(toward, half), 0, 1)) - 6.98316) * vh)
        peak = (exponent + 2) / 8 * np.clip(_dot(normals, half), 0.0, 1.0) ** exponent
        shine = (mirrored * (1 - fresnel[:, None]) + fresnel[:, None]) * peak[:, None]
        total = total + lamp.colour * facing[:, None] * (base + shine)
    return total


def _rays(lamp: PointLight, points: Array) -> tuple[Array, Array]:
    """Directions from points to a lamp, and how much of its light comes there."""
    if lamp.position is None:
        return -lamp.direction[None, :], np.ones(len(points))
    back = unit(lamp.position - points)
    if lamp.cone is None:
        return back, np.ones(len(points))
    edge, bright = lamp.cone
    share = np.clip((-back @ lamp.direction - edge) / max(bright - edge, 1e-9), 0.0, 1.0)
    return back, share * share * (3 - 2 * share)


def _dot(a: Array, b: Array) -> Array:
    found: Array = (a * b).sum(axis=-1)
    return found
