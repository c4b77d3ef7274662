"""Labs under fingers: turning, pinching, pulling a body, and a page that still scrolls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from playwright.sync_api import Browser, CDPSession, Page

from support.fixture_cases import fixture_text
from support.lab_page import MOUNT, PAGE, SWING, until, wait_for_condition, wake, watch_page

pytestmark = pytest.mark.browser

HEIGHT = 390 / 1.6
"""CSS pixels of the picture."""

Phone = tuple[Page, "Fingers", list[str]]


PICTURE = "() => new Promise((done) => requestAnimationFrame(() => done()))"
RESTS = fixture_text("scripts/rests.js")
"""Done when the page has not scrolled for some pictures."""


class Fingers:
    """Fingers on a page's screen; the pointer events and scrolling they cause are the browser's."""

    def __init__(self, page: Page, session: CDPSession) -> None:
        self.page, self._session = page, session
        self._down: dict[int, tuple[float, float]] = {}

    def _send(self, kind: str) -> None:
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in self._down.items()]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def down(self, *places: tuple[float, float]) -> None:
        for place in places:
            self._down[len(self._down)] = place
            self._send("touchStart")

    def move(self, *targets: tuple[float, float], steps: int = 8) -> None:
        """Draw all fingers to their targets, at the same time."""
        starts = dict(self._down)
        for k in range(1, steps + 1):
            for i, (x, y) in enumerate(targets):
                x0, y0 = starts[i]
                self._down[i] = (x0 + (x - x0) * k / steps, y0 + (y - y0) * k / steps)
            self._send("touchMove")
            self.page.evaluate(PICTURE)

    def up(self) -> None:
        self._down.clear()
        self._send("touchEnd")

    def tap(self, x: float, y: float) -> None:
        """Down and up at once, so that it is no rest however slow the machine is."""
        self.page.touchscreen.tap(x, y)


@pytest.fixture(scope="module")
def screen(browsers: Mapping[str, Browser], base: str) -> Iterator[Phone]:
    """A small screen with touch; one page and one engine for all tests."""
    with browsers["webgl"].new_context(
        viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True
    ) as context:
        page, console = watch_page(context)
        page.goto(base + PAGE)
        # Fonts that come later move the text, and the page with it.
        page.evaluate("() => document.fonts.ready.then(() => 0)")
        yield page, Fingers(page, context.new_cdp_session(page)), console


@pytest.fixture
def phone(screen: Phone) -> Iterator[Phone]:
    """The swing as it is at first, at rest in the middle of the window."""
    page, _, console = screen
    page.evaluate("() => window.made?.dispose()")
    page.evaluate(MOUNT, SWING)
    wake(page, SWING)
    until(page, "() => made.state === 'paused' && made.view.frame !== null && made.view.height > 0")
    page.evaluate(RESTS, 10)
    yield screen
    assert console == []


def camera(page: Page) -> dict[str, Any]:
    camera_state: dict[str, Any] = page.evaluate(
        "() => { const { azimuth, elevation, distance, target } = window.made.view.camera\n"
        "return { azimuth, elevation, distance, target: [...target] } }"
    )
    return camera_state


def middle(page: Page) -> tuple[float, float]:
    box = page.locator("#tried .lab-view").bounding_box()
    assert box is not None
    assert (box["y"] > 50, box["height"]) == (True, pytest.approx(HEIGHT, abs=3))
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def scrolled(page: Page) -> float:
    return float(page.evaluate("() => window.scrollY"))


def focused(page: Page) -> bool:
    return bool(page.evaluate("() => document.activeElement === window.made.view.element"))


def expect_turned(page: Page, before: dict[str, Any], **pixels: float) -> None:
    """Wait until the view has turned by so many pixels; its height is half a turn."""
    expected = {name: before[name] - 180 * by / HEIGHT for name, by in pixels.items()}

    def has_turned() -> bool:
        now = camera(page)
        return all(abs(now[name] - angle) <= 1 for name, angle in expected.items())

    wait_for_condition(page, has_turned)


def test_one_finger_turns(phone: Phone) -> None:
    page, fingers, _ = phone
    x, y = middle(page)
    before, scroll = camera(page), scrolled(page)
    fingers.down((x - 60, y))
    fingers.move((x + 60, y))
    # A finger that began sideways may go on up and down.
    fingers.move((x + 60, y + 60))
    fingers.up()
    expect_turned(page, before, azimuth=120, elevation=60)
    assert camera(page)["distance"] == before["distance"]
    assert scrolled(page) == scroll


def test_finger_that_goes_up_or_down_scrolls_the_page_each_time(phone: Phone) -> None:
    page, fingers, _ = phone
    for way in (-1, 1, -1):
        x, y = middle(page)
        free_x = x + 100  # not on the body, which a finger that rests would pull
        before, scroll = camera(page), scrolled(page)
        fingers.down((free_x, y))
        fingers.move((free_x, y + way * 120), steps=12)
        fingers.up()
        wait_for_condition(page, lambda: (scroll - scrolled(page)) * way > 60)  # noqa: B023
        page.evaluate(RESTS, 20)
        assert camera(page) == before
        assert not focused(page)


def test_tap_gives_the_picture_every_gesture(phone: Phone) -> None:
    page, fingers, _ = phone
    x, y = middle(page)
    fingers.tap(x, y)
    wait_for_condition(page, lambda: focused(page))
    before, scroll = camera(page), scrolled(page)
    fingers.down((x, y - 40))
    fingers.move((x, y + 40), steps=12)
    fingers.up()
    expect_turned(page, before, elevation=80)
    assert scrolled(page) == scroll

    def left() -> bool:
        fingers.tap(x, y - HEIGHT / 2 - 20)  # what follows a drag at once is no tap
        return not focused(page)

    # Beside it, another tap gives the page its own back.
    wait_for_condition(page, left)


@pytest.mark.parametrize("sideways", [True, False])
def test_two_fingers_zoom_and_move(phone: Phone, sideways: bool) -> None:
    page, fingers, _ = phone
    x, y = middle(page)
    direction = (1.0, 0.0) if sideways else (0.0, 1.0)

    def at(distance: float, dx: float = 0.0, dy: float = 0.0) -> tuple[float, float]:
        return x + distance * direction[0] + dx, y + distance * direction[1] + dy

    before, scroll = camera(page), scrolled(page)
    fingers.down(at(-30), at(30))
    fingers.move(at(-90), at(90))
    third = pytest.approx(before["distance"] / 3, rel=0.05)
    wait_for_condition(page, lambda: camera(page)["distance"] == third)
    wide = camera(page)
    assert wide["target"] == pytest.approx(before["target"], abs=0.02)
    fingers.move(at(-90, 0, 45), at(90, 0, 45))
    height = 2 * wide["distance"] * math.tan(math.pi / 8)
    up = height * math.cos(math.radians(wide["elevation"])) * 45 / HEIGHT
    expected_height = pytest.approx(wide["target"][2] + up, abs=0.1 * abs(up))
    wait_for_condition(page, lambda: camera(page)["target"][2] == expected_height)
    moved_camera = camera(page)
    fingers.up()
    assert moved_camera["distance"] == pytest.approx(wide["distance"], rel=0.02)
    assert (moved_camera["azimuth"], moved_camera["elevation"]) == (
        before["azimuth"],
        before["elevation"],
    )
    assert scrolled(page) == scroll
    until(page, "window.visualViewport.scale === 1")


def test_finger_that_rests_on_a_body_pulls_it(phone: Phone) -> None:
    page, fingers, _ = phone
    page.locator("#tried .lab-slider input").fill("0")  # no gravity; it begins to move
    until(page, "() => window.made.state === 'playing'")
    page.evaluate("() => window.made.view.element.scrollIntoView({ block: 'center' })")
    page.evaluate(RESTS, 10)
    x, y = middle(page)
    scale = HEIGHT / (2 * 2.5 * math.tan(math.pi / 8))
    end = x - 0.4 * math.sin(2.5) * scale, y + 0.4 * math.cos(2.5) * scale
    before, scroll = camera(page), scrolled(page)
    fingers.down(end)
    until(page, "() => window.made.view.frame[3] === 1")
    fingers.move((x, y + 0.45 * scale), steps=20)
    # The rod comes to hang where it is drawn to; the view and the page stay as they are.
    hangs = "() => Math.abs(parseFloat(document.querySelector('#tried dd').textContent\
      .trim().replace('−', '-'))) < 0.6"
    until(page, hangs)
    assert camera(page) == before
    assert scrolled(page) == scroll
    fingers.up()
    until(page, "() => window.made.view.frame[3] === 0")


def test_finger_that_rests_where_nothing_is_turns_as_ever(phone: Phone) -> None:
    page, fingers, _ = phone
    x, y = middle(page)
    before = camera(page)
    fingers.down((x - 150, y + 100))
    until(page, "() => made.hands.pointers.size === 1 && made.hands.restingFinger === null")
    fingers.move((x - 50, y + 100))
    fingers.up()
    expect_turned(page, before, azimuth=100)
    assert page.evaluate("() => window.made.view.frame[3]") == 0


def test_buttons_sliders_and_lists_by_touch(phone: Phone) -> None:
    page, fingers, _ = phone
    slider = page.locator("#tried .lab-slider input")
    slider.scroll_into_view_if_needed()
    page.evaluate(RESTS, 10)
    box = slider.bounding_box()
    assert box is not None
    assert box["height"] >= 16, "a finger can hit it"
    y = box["y"] + box["height"] / 2
    fingers.down((box["x"] + box["width"] / 2, y))
    fingers.move((box["x"] + box["width"] * 0.9, y))
    fingers.up()
    wait_for_condition(page, lambda: abs(float(slider.input_value()) - 18) <= 1.2)
    page.locator("#tried .lab-buttons button").tap()
    until(page, "() => window.made.values[0] > 16")
    until(page, "() => window.made.state === 'playing'")
    page.locator("#tried .lab-play").tap()
    until(page, "() => window.made.state === 'paused'")
