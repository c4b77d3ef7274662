"""What a lab looks like: the live picture is the recorded one, with mirrors, metals and ropes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from support.built_sites import BuiltCourses, lesson_files
from support.folder_server import served
from support.lab_page import lab, watched

pytestmark = pytest.mark.browser

ASSETS = """
  <texture name="tiles" type="2d" builtin="checker" rgb1="0.2 0.3 0.4" rgb2="0.1 0.2 0.3"
    width="300" height="300"/>
  <texture name="crossed" type="cube" builtin="flat" mark="cross" rgb1="0.8 0.5 0.2"
    rgb2="0.2 0.5 0.8" markrgb="1 1 1" width="64" height="64"/>
  <texture name="fade" type="2d" builtin="gradient" rgb1="1 0.2 0.2" rgb2="0.2 0.2 1" width="64"
    height="64"/>
  <material name="floor" texture="tiles" texuniform="true" texrepeat="2 2" reflectance="0.3"/>
  <material name="steel" rgba="0.75 0.75 0.78 1" metallic="1" roughness="0.3"/>
  <material name="rubber" rgba="0.8 0.1 0.1 1" roughness="0.7"/>
  <material name="gloss" rgba="0.1 0.5 0.2 1" specular="1" shininess="1"/>
  <material name="glow" emission="0.6" texture="fade"/>
  <material name="crate" texture="crossed"/>
"""
THINGS = """
  <geom type="plane" size="3 2 0.1" material="floor"/>
  <geom pos="-1.2 0 0.3" size="0.3" material="steel"/>
  <geom pos="-0.4 0 0.3" size="0.3" material="rubber"/>
  <geom pos="0.4 0 0.3" size="0.3" material="gloss"/>
  <geom type="box" pos="-0.8 0.9 0.4" size="0.25 0.25 0.4" material="crate"/>
  <geom type="cylinder" pos="0 0.9 0.3" size="0.3 0.3" material="glow"/>
  <geom type="capsule" pos="0.9 0.9 0.5" size="0.2 0.3" rgba="0.3 0.3 0.8 0.5"/>
  <flexcomp name="rope" type="grid" count="8 1 1" spacing="0.3 0.1 0.1" pos="0 -0.7 0.8" dim="1"
    radius="0.04" rgba="0.9 0.6 0.2 1" mass="0.2"><edge equality="true"/><pin id="0 7"/></flexcomp>
"""
LIGHTS = """
  <light pos="1 -2 4" dir="-0.2 0.4 -1" type="spot" cutoff="50" exponent="10"
    diffuse="0.6 0.6 0.5"/>
  <light type="directional" dir="-0.5 0.3 -1" diffuse="0.3 0.3 0.35"/>
  <light type="point" pos="-2 0 2" diffuse="0.2 0.1 0.1"/>
"""
SKY = """<texture type="skybox" builtin="gradient" rgb1="0.3 0.5 0.7" rgb2="0.05 0.1 0.15"
  width="32" height="192"/>"""


def mjcf(things: str, assets: str = "") -> str:
    return f"<mujoco><asset>{assets}</asset><worldbody>{things}</worldbody></mujoco>"


BALL = '<geom pos="0 0 1" size="0.3" rgba="1 0 0 1"/>'
MODELS = {
    "lit": mjcf(LIGHTS + THINGS, SKY + ASSETS),
    "unlit": mjcf(THINGS, ASSETS),
    "mirror": mjcf(
        f'<geom type="box" size="1.5 1.5 0.1" material="m"/>{BALL}',
        '<material name="m" rgba="0 0 0 1" specular="0" reflectance="0.8"/>',
    ),
    "dull": mjcf(f'<geom type="box" size="1.5 1.5 0.1" rgba="0 0 0 1"/>{BALL}'),
    "endless": mjcf(
        f'{LIGHTS}<geom type="plane" size="0 0 1" material="t" rgba="1 1 1 1"/>{BALL}',
        '<texture name="t" type="2d" builtin="checker" rgb1="1 1 1" rgb2="0.5 0.5 0.5" width="64" '
        'height="64"/><material name="t" texture="t" reflectance="0.2"/>',
    ),
}
VIEWS = [(name, -22.0) for name in MODELS] + [("lit", 20.0), ("endless", 15.0)]
"""Models, and how steeply the camera looks at them; the last two from below."""
MIRROR, DULL, ENDLESS = 2, 3, 4
WINDOW: Any = {"width": 600, "height": 500}
"""A small one, since pictures with shadows take long without a graphics processor."""


def fence(model: str, elevation: float) -> str:
    camera = {"azimuth": 75, "elevation": elevation, "distance": 5, "target": [0, 0.2, 0.3]}
    fields = {"title": model, "model": model, "height": 300, "camera": camera}
    given = {**fields, "verify": {"seconds": 0.02, "rtol": 1}}
    return f"```lab simlab\n{json.dumps(given)}\n```\n\n"


@pytest.fixture(scope="session")
def drawn(built_courses: BuiltCourses) -> Iterator[str]:
    """The address of a page with one lab for each view."""
    lesson = "## First\n\n" + "".join(fence(*view) for view in VIEWS) + "Text.\n"
    models = {f"models/{name}.xml": text for name, text in MODELS.items()}
    folder = built_courses.of_files("drawing", {**lesson_files(lesson), **models})
    with served(folder.root / "public") as address:
        yield f"{address}lessons/1.1-one.html"


COMPARE = """async (n) => {
  const lab = document.querySelectorAll('.lab')[n]
  const live = lab.querySelector('canvas.lab-still')
  const recorded = new Image()
  recorded.src = lab.querySelector('.lab-static img').src
  await recorded.decode()
  const { width, height } = live
  const pixels = (source, w) => {
    const canvas = Object.assign(document.createElement('canvas'), { width, height })
    const context = canvas.getContext('2d', { willReadFrequently: true })
    context.fillStyle = 'white'
    context.fillRect(0, 0, width, height)
    context.drawImage(source, (width - w) / 2, 0, w, height)
    return context.getImageData(0, 0, width, height).data
  }
  const wide = (recorded.width * height) / recorded.height
  const [a, b] = [pixels(live, width), pixels(recorded, wide)]
  const differences = []
  for (let y = 2; y < height - 2; y++) {
    for (let x = Math.ceil(Math.max(0, (width - wide) / 2)) + 2; x < Math.min(width, (width + wide) / 2) - 2; x++) {
      for (let c = 0; c < 3; c++) differences.push(Math.abs(a[4 * (y * width + x) + c] - b[4 * (y * width + x) + c]))
    }
  }
  differences.sort((p, q) => p - q)
  const at = (share) => differences[Math.floor(share * (differences.length - 1))]
  return { middle: at(0.5), most: at(0.9) }
}"""  # noqa: E501

REDS = """(n) => {
  const canvas = document.querySelectorAll('.lab')[n].querySelector('canvas.lab-still')
  const { width, height } = canvas
  const { data } = canvas.getContext('2d').getImageData(0, 0, width, height)
  let count = 0
  for (let i = 0; i < data.length; i += 4) if (data[i] > 60 && data[i] > 3 * data[i + 1]) count++
  return count
}"""


GREENS = """(n) => {
  const canvas = document.querySelectorAll('.lab')[n].querySelector('canvas.lab-still')
  const { width, height } = canvas
  const { data } = canvas.getContext('2d').getImageData(0, 0, width, height)
  return Array.from({ length: width * height }, (_, i) => data[4 * i + 1])
}"""


def ready(page: Page, number: int) -> None:
    """A lab that shows its first picture."""
    found = lab(page, number)
    found.locator(".lab-poster").wait_for(state="detached")


@pytest.fixture(scope="module")
def shown(browsers: Mapping[str, Browser], drawn: str) -> Iterator[tuple[Page, list[str]]]:
    """The page, and what it says to the console."""
    with browsers["webgl"].new_context(viewport=WINDOW) as context:
        page, said = watched(context)
        page.goto(drawn)
        yield page, said


def test_the_recorded_picture_is_the_live_one(shown: tuple[Page, list[str]]) -> None:
    """Up to the edges, which fall between other pixels."""
    page, said = shown
    wrong = []
    for number, view in enumerate(VIEWS):
        ready(page, number)
        found = page.evaluate(COMPARE, number)
        if found["middle"] > 2 or found["most"] > 16:
            wrong.append((view, found))
    assert wrong == []
    assert said == []


def test_a_mirror_shows_what_stands_on_it(shown: tuple[Page, list[str]]) -> None:
    page, _ = shown
    ready(page, MIRROR)
    ready(page, DULL)
    mirrored, plain = (page.evaluate(REDS, number) for number in (MIRROR, DULL))
    assert mirrored > 1.5 * plain > 0


def test_with_a_graphics_processor_there_are_shadows_too(
    browsers: Mapping[str, Browser], drawn: str, shown: tuple[Page, list[str]]
) -> None:
    """By way of a browser that says it had one: mirrors, and maps for all kinds of lights."""
    ready(shown[0], ENDLESS)
    without = np.array(shown[0].evaluate(GREENS, ENDLESS))
    with browsers["webgl"].new_context(viewport=WINDOW) as context:
        context.add_init_script(
            "const { prototype } = WebGL2RenderingContext, { getParameter } = prototype\n"
            "prototype.getParameter = function (name) {\n"
            "  return name === 0x9246 ? 'A graphics processor' : getParameter.call(this, name)\n"
            "}"
        )
        page, said = watched(context)
        page.goto(drawn)
        ready(page, ENDLESS)
        assert page.evaluate(COMPARE, ENDLESS)["middle"] <= 2, "the rest is as without"
        darker = without - np.array(page.evaluate(GREENS, ENDLESS)) > 15
        assert 500 < darker.sum() < 0.2 * darker.size
        assert said == []
