"""The surfaces of MuJoCo's geoms as triangles, in each geom's own frame, and their colours.

Sizes are MuJoCo's: half-lengths of a box, radius and half-length of the axis of a cylinder and a
capsule, semi-axes of an ellipsoid. Triangles share vertices only where the surface is smooth, so
that normals at the vertices make curves look smooth and edges sharp.

The live view (`lights.js` and `materials.js` of the page) draws with three.js's Blinn-Phong
material, set to match MuJoCo's renderer. The formulas here are the same, without shadows, which the
live view, too, leaves out if there is no graphics processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Kind: TypeAlias = Literal[
    "plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"
]

_SEGMENTS = 28
"""Around a round surface."""
_FAR = 30.0
"""Half-length, m, of a plane without a size."""
_ROPE_SEGMENTS = 12
_HEAD_LENGTH = 3.0
"""Of an arrow's head, in radii of its shaft."""
_SMOOTH = 0.8
"""Least cosine between the normals of a face and of its vertex at an edge that is not sharp."""


class Surface(Struct, frozen=True):
    """Triangles with normals."""

    vertices: Array
    """(n, 3), m."""
    normals: Array
    """(n, 3), of length 1."""
    faces: NDArray[np.int64]
    """(m, 3), counter-clockwise seen from outside."""
    uv: Array | None = None
    """(n, 2), texture coordinates from a file."""


def surface(kind: Kind, size: tuple[float, ...], mesh: Surface | None = None) -> Surface | None:
    """Make the surface of a geom; `None` for a mesh that is missing."""
    match kind:
        case "mesh" | "sdf" | "hfield":
            return mesh
        case "plane":
            x, y = (half if half > 0 else _FAR for half in size[:2])
            corners = np.array([(-x, -y, 0.0), (-x, y, 0.0), (x, -y, 0.0), (x, y, 0.0)])
            return Surface(corners, np.tile((0.0, 0.0, 1.0), (4, 1)), grid_faces(2, 2))
        case "box":
            square = ((-1, -1), (1, -1), (1, 1), (-1, 1))
            sides = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
            vertices = [
                np.roll((sign, a * sign, b), axis) for axis, sign in sides for a, b in square
            ]
            outward = [np.roll((sign, 0.0, 0.0), axis) for axis, sign in sides]
            faces = 4 * np.arange(6)[:, None, None] + ((0, 1, 2), (0, 2, 3))
            return Surface(
                np.array(vertices) * size[:3], np.repeat(outward, 4, axis=0), faces.reshape(-1, 3)
            )
        case "cylinder":
            radius, half = size[:2]
            rim, hub = [(radius, half), (radius, -half)], [(0, half), (0, -half)]
            profile = np.array([hub[0], rim[0], *rim, rim[1], hub[1]])
            return _revolve(profile, np.repeat([(0.0, 1.0), (1.0, 0.0), (0.0, -1.0)], 2, axis=0))
        case "capsule":
            return _capsule(size[0], size[1], _SEGMENTS)
        case "sphere" | "ellipsoid":
            ball = _capsule(1.0, 0.0, _SEGMENTS)
            axes = np.array(size[:3] if kind == "ellipsoid" else (size[0],) * 3)
            return Surface(ball.normals * axes, unit(ball.normals / axes), ball.faces)


def arrow(radius: float, length: float, *, head: float, double: bool) -> Surface:
    """Make an arrow along z from the origin, or to both sides of it; `head` in shaft widths."""
    tip, brim = min(_HEAD_LENGTH * radius, length / 2), head * radius
    neck = length - tip
    upper = [(0.0, length), (brim, neck), (brim, neck), (radius, neck), (radius, neck)]
    normals = [(tip, brim), (tip, brim), (0.0, -1.0), (0.0, -1.0), (1.0, 0.0)]
    if double:
        lower = [(r, -z) for r, z in upper[::-1]]
        lower_normals = [(r, -z) for r, z in normals[::-1]]
    else:
        lower = [(radius, 0.0), (radius, 0.0), (0.0, 0.0)]
        lower_normals = [(1.0, 0.0), (0.0, -1.0), (0.0, -1.0)]
    return _revolve(np.array(upper + lower), unit(np.array(normals + lower_normals)))


def flat_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """Make a mesh with flat shading: every triangle has vertices of its own."""
    corners = vertices[faces]
    normals = np.repeat(unit(_area_normals(corners)), 3, axis=0)
    return Surface(corners.reshape(-1, 3), normals, np.arange(3 * len(faces)).reshape(-1, 3))


def smooth_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """Make a mesh whose normals average those of the adjacent faces, weighted by area."""
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces, _area_normals(vertices[faces])[:, None])
    return Surface(vertices, unit(normals), faces)


def sharpen(corners: Array, normals: Array) -> Array:
    """Replace normals (m, 3, 3) of corners (m, 3, 3) by the face's where they differ much."""
    face = unit(_area_normals(corners))[:, None]
    sharp = (face * normals).sum(axis=2, keepdims=True) < _SMOOTH
    has_area = np.any(face != 0, axis=2, keepdims=True)
    corner_normals: Array = np.where(sharp & has_area, face, normals)
    return corner_normals


def ropes(points: Array, ends: NDArray[np.int64], radius: float) -> Surface:
    """Make round lines between points (n, 3); `ends` (m, 2) holds the indices of their ends."""
    parts = []
    for a, b in points[ends]:
        direction = b - a if np.any(a != b) else np.array((0.0, 0.0, 1.0))
        z = unit(direction)
        x = unit(np.cross(z, np.eye(3)[np.abs(z).argmin()]))
        axes = np.stack((x, np.cross(z, x), z))
        capsule = _capsule(radius, float(np.linalg.norm(b - a)) / 2, _ROPE_SEGMENTS)
        middle = (a + b) / 2
        parts.append(
            Surface(capsule.vertices @ axes + middle, capsule.normals @ axes, capsule.faces)
        )
    return join_surfaces(parts)


def join_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """Join surfaces without texture coordinates into one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in surfaces[:-1])])
    return Surface(
        np.concatenate([part.vertices for part in surfaces]),
        np.concatenate([part.normals for part in surfaces]),
        np.concatenate([part.faces + n for part, n in zip(surfaces, starts, strict=True)]),
    )


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Make two triangles for each cell of a grid of vertices."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    first = np.stack((a, b, c), axis=-1).reshape(-1, 3)
    second = np.stack((a, c, d), axis=-1).reshape(-1, 3)
    return np.concatenate((first, second))


def _area_normals(corners: Array) -> Array:
    """Return the normals of triangles (m, 3, 3), with twice their area as length."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def unit(vectors: Array) -> Array:
    """Scale vectors to length 1; those of length 0 stay."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _capsule(radius: float, half: float, segments: int) -> Surface:
    quarter = np.linspace(0.0, np.pi / 2, segments // 4 + 1)
    polar = np.concatenate((quarter, np.pi - quarter[::-1]))
    normals = np.column_stack((np.sin(polar), np.cos(polar)))
    shift = np.repeat((half, -half), len(quarter))
    profile = np.column_stack((radius * normals[:, 0], radius * normals[:, 1] + shift))
    return _revolve(profile, normals, segments)


def _revolve(profile: Array, normals: Array, segments: int = _SEGMENTS) -> Surface:
    """Revolve a profile, points (distance from z, height) from top to bottom, around z."""
    angles = np.linspace(0.0, 2 * np.pi, segments + 1)

    def turn(rows: Array) -> Array:
        x, y = np.outer(rows[:, 0], np.cos(angles)), np.outer(rows[:, 0], np.sin(angles))
        z = np.repeat(rows[:, 1:], segments + 1, axis=1)
        return np.stack((x, y, z), axis=-1).reshape(-1, 3)

    return Surface(turn(profile), turn(normals), grid_faces(len(profile), segments + 1))


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
        facing = np.clip(dot(normals, back), 0.0, None) * strength
        half = unit(back + toward_eye)
        fresnel = np.exp2((-5.55473 * (vh := np.clip(dot(toward_eye, half), 0, 1)) - 6.98316) * vh)
        peak = (exponent + 2) / 8 * np.clip(dot(normals, half), 0.0, 1.0) ** exponent
        shine = (reflected_share * (1 - fresnel[:, None]) + fresnel[:, None]) * peak[:, None]
        total = total + lamp.colour * facing[:, None] * (base + shine)
    return total


def _rays(lamp: PointLight, points: Array) -> tuple[Array, Array]:
    if lamp.position is None:
        return -lamp.direction[None, :], np.ones(len(points))
    back = unit(lamp.position - points)
    if lamp.cone is None:
        return back, np.ones(len(points))
    edge, bright = lamp.cone
    share = np.clip((-back @ lamp.direction - edge) / max(bright - edge, 1e-9), 0.0, 1.0)
    return back, share * share * (3 - 2 * share)


def dot(a: Array, b: Array) -> Array:
    """The scalar products (n,) of vectors (n, 3), or (1, 3)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))
