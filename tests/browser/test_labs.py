"""Labs in a headless Chromium: what a reader does with them, and that the physics is MuJoCo's.

Most tests share one page, and begin with the swing at rest: an engine takes a second to start.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from support.built_sites import Site
from support.lab_page import (
    ALL,
    AUTO,
    PAGE,
    SWING,
    TWINS,
    floats,
    lab,
    press,
    reach,
    readout,
    shows,
    state_of,
    time_of,
    until,
    wait_for_change,
    wait_for_condition,
    wait_until_still,
    watch_page,
)

pytestmark = pytest.mark.browser

PICTURES = """(n) => new Promise((done) => {
  const next = () => (n-- > 0 ? requestAnimationFrame(next) : done())
  next()
})"""


@dataclass(frozen=True, slots=True)
class Lesson:
    """The page that tests share."""

    page: Page
    console: list[str]


@pytest.fixture(scope="module")
def lesson(browsers: Mapping[str, Browser], base: str) -> Iterator[Lesson]:
    size = {"width": 1000, "height": 800}
    with browsers["webgl"].new_context(viewport=size) as context:  # type: ignore[arg-type]
        page, console = watch_page(context)
        page.goto(base + PAGE)
        yield Lesson(page, console)


@pytest.fixture
def swing(lesson: Lesson) -> Iterator[Locator]:
    """The swing of the shared page, at rest and as it is at first."""
    page = lesson.page
    swing_lab = lab(page, SWING, None)
    reach_rest(swing_lab)
    press(swing_lab, "One step")  # so that no control starts the motion
    if swing_lab.get_by_label("gravity").input_value() != "9.8":
        swing_lab.get_by_label("gravity").fill("9.8")
    swing_lab.get_by_label("start").select_option("high")
    swing_lab.get_by_role("button", name="Reset").click()
    expect(swing_lab.locator(".lab-time")).to_have_text(re.compile(r"^0\.00"))
    expect(swing_lab.locator(".lab-live dd").first).to_contain_text("2.500")
    yield swing_lab
    assert lesson.console == []


def reach_rest(lab_element: Locator) -> None:
    """A lab that is there and does not run."""
    expect(lab_element).to_have_attribute("data-state", re.compile("asleep|paused|playing"))
    if lab_element.get_attribute("data-state") == "playing":
        press(lab_element, "Pause")
    expect(lab_element).to_have_attribute("data-state", re.compile("asleep|paused"))


def pictures(page: Page, count: int) -> None:
    """Let a page draw so often: a lab that runs has made steps by then."""
    page.evaluate(PICTURES, count)


def native(course: Site, steps: int, angle: float, gravity: float = -9.8) -> np.ndarray:
    """The state of the pendulum after so many steps, of native MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(course.root / "models/pendulum.xml"))
    model.opt.gravity[2] = gravity
    data = mujoco.MjData(model)
    data.qpos[0] = angle
    mujoco.mj_forward(model, data)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return np.array([data.time, *data.qpos, *data.qvel])


def test_engine_is_fetched_once_and_only_when_something_is_asked_of_a_lab(
    browsers: Mapping[str, Browser], base: str
) -> None:
    fetched = "() => performance.getEntriesByType('resource').map(({ name }) => name)"
    with browsers["webgl"].new_context() as context:
        page, _ = watch_page(context)
        page.goto(base + PAGE, wait_until="networkidle")
        addresses: list[str] = page.evaluate(fetched)
        assert not [url for url in addresses if "/labs/" in url and not url.endswith(".png")]
        swing = lab(page, SWING, None)
        expect(swing).to_have_attribute("data-state", "asleep")
        assert page.workers == []
        press(swing, "Play")
        reach(page, SWING, "playing")
        (worker,) = page.workers
        addresses = page.evaluate(fetched) + worker.evaluate(fetched)
    names = [re.sub(r"\.[0-9a-f]{8}", "", url.rsplit("/", 1)[1]) for url in addresses]
    assert "lab.js" in names
    assert names.count("mujoco.wasm") == 1


def test_state_is_that_of_native_mujoco(lesson: Lesson, swing: Locator, course: Site) -> None:
    page = lesson.page
    press(swing, "Play")
    wait_for_condition(page, lambda: time_of(swing) > 0.4)
    press(swing, "Pause")
    reach(page, SWING, "paused")
    state = state_of(page, swing)
    steps = int(str(state["n"]))
    assert steps > 100
    expected = native(course, steps, 2.5)
    np.testing.assert_allclose(floats(state)[:3], expected, rtol=1e-9)
    shows(swing, "angle", f"{expected[1]:.3f}")
    wait_for_condition(page, lambda: time_of(swing) == pytest.approx(expected[0], abs=0.006))


def test_controls_do_what_they_say(lesson: Lesson, swing: Locator, course: Site) -> None:
    page = lesson.page
    swing.get_by_label("start").select_option("low")
    expect(swing.locator(".lab-live dd").first).to_contain_text("0.500")
    slider = swing.get_by_label("gravity")
    slider.fill("3.7")
    expect(swing.locator(".lab-value")).to_have_text("3.7\u00a0m/s²")
    expect(slider).to_have_attribute("aria-valuetext", "3.7\u00a0m/s²")
    for _ in range(5):
        press(swing, "One step")
    state = state_of(page, swing)
    assert state["v"] == [3.7, 0.5, None]
    np.testing.assert_allclose(floats(state)[:3], native(course, 5, 0.5, -3.7), rtol=1e-12)
    with page.expect_download() as download:
        press(swing, "Export as Python")
    text = Path(download.value.path()).read_text(encoding="utf-8")
    compile(text, download.value.suggested_filename, "exec")
    assert "{{control" not in text
    assert "3.7" in text
    press(swing, "Push")
    assert floats(state_of(page, swing))[2] == pytest.approx(3, abs=0.1)
    press(swing, "Reset")
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.00"))
    assert floats(state_of(page, swing))[:3].tolist() == [0, 0.5, 0]


def test_link_leads_back_to_the_state(lesson: Lesson, swing: Locator) -> None:
    page = lesson.page
    swing.get_by_label("start").select_option("low")
    press(swing, "Push")
    for _ in range(7):
        press(swing, "One step")
    state = state_of(page, swing)
    second_page, console = watch_page(page.context)
    second_page.goto(page.evaluate("() => location.href"))
    again = second_page.locator(".lab").nth(SWING)
    expect(again).to_have_attribute("data-state", "paused")
    expect(again.locator(".lab-time")).to_have_text(re.compile(r"^0\.01"))
    expect(again.locator(".lab-view")).to_be_in_viewport()
    expect(again.get_by_label("start")).to_have_value("low")
    press(swing, "One step")
    press(again, "One step")
    first_state, second_state = state_of(page, swing), state_of(second_page, again)
    assert first_state["n"] == second_state["n"] == int(str(state["n"])) + 1
    assert floats(first_state)[:3].tobytes() == floats(second_state)[:3].tobytes()
    assert console == []
    second_page.close()


def test_keys_on_the_picture(lesson: Lesson, swing: Locator) -> None:
    page = lesson.page
    view = swing.locator(".lab-view")
    view.focus()
    page.keyboard.press(".")
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.00"))
    expect(view.locator(".lab-scale")).to_have_accessible_name("Scale: the bar is 0.5 m long")
    first = wait_until_still(page, view)
    page.keyboard.press("ArrowLeft")
    turned_picture = wait_for_change(page, view, first)
    page.keyboard.press("+")
    wait_for_change(page, view, turned_picture)
    page.keyboard.press("0")
    wait_for_condition(page, lambda: view.screenshot() == first)
    page.keyboard.press(" ")
    reach(page, SWING, "playing")
    page.keyboard.press(" ")
    reach(page, SWING, "paused")
    page.keyboard.press("r")
    expect(swing.locator(".lab-announce")).to_have_text("Reset.")
    expect(swing.locator(".lab-live dd").first).to_contain_text("2.500")


def test_time_goes_back_and_on_to_the_last_bit(
    lesson: Lesson, swing: Locator, course: Site
) -> None:
    page = lesson.page
    bar = swing.get_by_label("Time of the run")
    expect(bar).to_be_disabled()
    press(swing, "Play")
    wait_for_condition(page, lambda: time_of(swing) > 1)
    press(swing, "Pause")
    reach(page, SWING, "paused")
    swing.get_by_label("gravity").fill("15")
    expect(swing.locator(".lab-value").first).to_contain_text("15.0")
    press(swing, "One step")
    last = state_of(page, swing)
    press(swing, "Previous event")
    expect(bar).to_have_attribute("aria-valuetext", re.compile("s, gravity$"))
    bar.press("PageDown")
    expect(bar).to_have_attribute("aria-valuetext", "0.00 s")
    expect(swing.get_by_label("Previous event")).to_be_disabled()
    bar.fill("0.5")
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.500* s$"))
    expect(swing.get_by_label("gravity")).to_have_value("9.8")
    expect(bar).to_have_attribute("aria-valuetext", "0.50 s")
    press(swing, "One step back")
    bar.press("ArrowLeft")
    swing.locator(".lab-view").press(",")
    swing.locator(".lab-view").press(".")
    expect(bar).to_have_value(re.compile(r"^0\.49[56]"))
    earlier = state_of(page, swing)
    steps = int(str(earlier["n"]))
    assert steps == 248
    np.testing.assert_allclose(floats(earlier)[:3], native(course, steps, 2.5), rtol=1e-9)
    bar.press("End")
    expect(swing.get_by_label("gravity")).to_have_value("15")
    assert state_of(page, swing) == last
    # A control that is used at an earlier time drops what came after.
    bar.fill("0.5")
    expect(swing.get_by_label("gravity")).to_have_value("9.8")
    press(swing, "Push")
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.500* s$"))
    bar.press("End")
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.500* s$"))


def _places(view: Locator) -> tuple[tuple[float, float], ...]:
    """Where the rod's end is drawn, at 2.5 rad from below, where it would hang, and a corner."""
    view.scroll_into_view_if_needed()
    box = view.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    scale = box["height"] / (2 * 2.5 * np.tan(np.pi / 8))
    end = (x - 0.4 * np.sin(2.5) * scale, y + 0.4 * np.cos(2.5) * scale)
    return end, (x, y + 0.45 * scale), (box["x"] + 20, box["y"] + 20)


def test_body_is_pulled_by_a_spring(lesson: Lesson, swing: Locator) -> None:
    page = lesson.page
    swing.get_by_label("gravity").fill("0")
    view = swing.locator(".lab-view")
    end, below, _ = _places(view)
    page.mouse.move(*end)
    page.keyboard.down("Control")
    page.mouse.down()
    page.mouse.move(*below, steps=5)
    page.keyboard.up("Control")
    view.press(" ")

    def stays() -> bool:
        """It hangs where it is drawn to, and does not only swing past."""
        for _ in range(6):
            if abs(float(readout(swing, "angle"))) >= 0.6:
                return False
            pictures(page, 5)
        return True

    wait_for_condition(page, stays)
    page.mouse.up()


def test_body_of_a_paused_lab_is_moved_by_the_hand_alone(lesson: Lesson, swing: Locator) -> None:
    page = lesson.page
    view = swing.locator(".lab-view")
    end, below, corner = _places(view)
    hand = swing.get_by_role("button", name="Grab bodies")
    hand.click()
    expect(hand).to_have_attribute("aria-pressed", "true")
    page.mouse.move(*end)
    page.mouse.down()
    page.mouse.move(*below, steps=3)
    page.mouse.up()
    wait_for_condition(page, lambda: abs(float(readout(swing, "angle"))) < 0.1)
    expect(swing.locator(".lab-time")).to_have_text(re.compile(r"^0\.00"))
    expect(swing).to_have_attribute("data-state", "paused")
    before = wait_until_still(page, view)
    page.mouse.move(*corner)
    page.mouse.down()
    page.mouse.move(corner[0] + 40, corner[1])
    page.mouse.up()
    wait_for_change(page, view, before)  # where nothing is, the hand turns the view
    view.press("0")
    hand.click()
    expect(hand).to_have_attribute("aria-pressed", "false")


def test_lab_out_of_sight_waits_and_goes_on_when_it_is_back(lesson: Lesson, swing: Locator) -> None:
    page = lesson.page
    press(swing, "Play")
    wait_for_condition(page, lambda: time_of(swing) > 0.1)
    page.evaluate("() => window.scrollTo(0, 0)")

    def waits() -> bool:
        before = time_of(swing)
        pictures(page, 60)
        return time_of(swing) == before

    wait_for_condition(page, waits)
    expect(swing).to_have_attribute("data-state", "playing")
    away = time_of(swing)
    swing.scroll_into_view_if_needed()
    wait_for_condition(page, lambda: time_of(swing) > away)


def test_goal_that_was_shown_does_not_count(lesson: Lesson, swing: Locator) -> None:
    goal = swing.locator(".lab-live .lab-goal")
    press(swing, "Show me")
    wait_for_condition(lesson.page, lambda: float(readout(swing, "angle")) > 4)
    expect(goal).to_contain_text("Not counted: more than your controls")
    press(swing, "Reset")
    expect(goal).to_contain_text("0.00 s of 0.2 s")
    expect(goal).not_to_contain_text("Reached")


def test_every_kind_of_geom_and_overlay_is_drawn_and_a_large_state_fits_into_a_link(
    lesson: Lesson,
) -> None:
    page = lesson.page
    lab_element = lab(page, ALL)
    before = wait_until_still(page, lab_element.locator(".lab-view"))
    for box in lab_element.locator(".lab-check input").all():
        box.check()
    for arrow in lab_element.locator(".lab-arrow").all():
        arrow.click()
        expect(arrow).to_have_attribute("aria-pressed", "true")
    press(lab_element, "Play")
    wait_for_condition(page, lambda: time_of(lab_element) > 0.6)  # by then bodies touch the ground
    wait_for_change(page, lab_element.locator(".lab-view"), before)
    press(lab_element, "Pause")
    reach(page, ALL, "paused")
    state = state_of(page, lab_element)
    assert floats(state).size > 500
    expect(lab_element.locator(".lab-message")).not_to_contain_text("controls only")
    assert lesson.console == []


def test_lab_of_a_kind_of_the_course_runs_two_simulations(lesson: Lesson) -> None:
    page = lesson.page
    twins = lab(page, TWINS, None)
    until(  # they stand side by side
        page,
        "new Set([...document.querySelectorAll('[data-kind=twin] .lab-view')]"
        ".map((view) => view.getBoundingClientRect().y)).size === 1",
    )
    views = twins.locator(".lab-view").all()
    first = [wait_until_still(page, view) for view in views]
    press(twins, "Play")
    wait_for_condition(page, lambda: time_of(twins) > 0.3)
    press(twins, "Pause")
    for view, before in zip(views, first, strict=True):
        wait_for_change(page, view, before)
    expect(twins.locator(".lab-plot .lab-trace").first).to_be_visible()
    expect(twins.locator(".lab-message:visible")).to_have_count(0)
    assert lesson.console == []


def test_lab_starts_by_itself_where_motion_is_welcome(lesson: Lesson) -> None:
    lab_element = lab(lesson.page, AUTO, "playing")
    hand = lab_element.get_by_role("button", name="Grab bodies")
    expect(hand).to_have_attribute("aria-pressed", "true")  # as the lab asks
    wait_for_condition(lesson.page, lambda: time_of(lab_element) > 0)
    press(lab_element, "Pause")
    reach(lesson.page, AUTO, "paused")
