"""Labs without an engine in a headless Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect

from support.built_sites import Site, Sites

pytestmark = pytest.mark.browser

PLOT, BALL = 0, 1


@pytest.fixture(scope="module")
def curves(sites: Sites) -> Site:
    return sites["curves"]


@pytest.fixture
def page(curves: Site, open_address: Callable[[str], Page]) -> Page:
    return open_address(f"{curves.url()}lessons/1.1-curves.html")


def lab(page: Page, number: int) -> Locator:
    place = page.locator(".lab").nth(number)
    place.scroll_into_view_if_needed()
    expect(place).to_have_class(re.compile("lab-on"))
    return place


def test_site_without_other_labs_has_no_engine(curves: Site) -> None:
    files = [path.name for path in (curves.public / "assets" / "labs").iterdir()]
    assert [name for name in files if re.match(r"(mujoco|worker|lab)\.", name)] == []
    assert any(name.startswith("equations.") for name in files)


def test_play_moves_the_point_to_the_end_of_the_motion(page: Page) -> None:
    ball = lab(page, BALL)
    clock = ball.locator(".lab-time")
    expect(clock).to_have_text("t = 0.00\u00a0s")
    ball.get_by_label("Speed").select_option("5")
    ball.get_by_role("button", name="Play").click()
    expect(clock).to_have_text("t = 4.00\u00a0s")
    expect(ball.get_by_role("button", name="Play")).to_be_visible()


def test_keys_move_the_point_along_the_curves(page: Page) -> None:
    plot = lab(page, PLOT)
    charts, clock = plot.locator(".lab-charts"), plot.locator(".lab-time")
    charts.focus()
    for key, text in (("End", "3.00"), ("Home", "0.00"), (".", "0.01"), ("r", "1.00")):
        charts.press(key)
        expect(clock).to_have_text(f"r = {text}")
    expect(plot.locator(".lab-live dd")).to_have_text(re.compile(r"5\.00"))
    charts.press("ArrowRight")
    expect(clock).to_have_text("r = 1.02")


def test_control_changes_curve_and_goal_and_reset_undoes_it(page: Page) -> None:
    plot = lab(page, PLOT)
    line, slider = plot.locator(".lab-live .lab-trace").first, plot.get_by_label("damping")
    before = line.get_attribute("d")
    assert before
    expect(plot.locator(".lab-ghost").first).to_have_attribute("d", "")
    slider.fill("0.4")
    expect(plot.locator(".lab-ghost").first).to_have_attribute("d", before)
    expect(plot.locator(".lab-goal-state")).to_contain_text("Reached at 0.00.")
    plot.get_by_label("Reset").click()
    expect(line).to_have_attribute("d", before)
    plot.get_by_role("button", name="Show me").click()
    expect(slider).to_have_value("0.4")


def test_solution_that_ends_is_told_and_the_rest_stays_usable(page: Page) -> None:
    ball = lab(page, BALL)
    ball.get_by_label("k", exact=True).fill("1")
    expect(ball.locator(".lab-message")).to_contain_text("a value is no longer finite")
    ball.get_by_label("k", exact=True).fill("2")
    expect(ball.locator(".lab-message")).to_be_hidden()
    expect(ball.locator(".lab-time")).not_to_have_text("t = 0.00\u00a0s")


def test_lesson_in_another_language_has_its_decimal_sign_before_and_after_the_start(
    curves: Site, open_address: Callable[[str], Page]
) -> None:
    address = "lessons/1.2-kurve.html"
    static = (curves.public / address).read_text()
    for text in (">0,5<", "x = 0,5", "<dd>0,75</dd>", "0,5 bis 2 in Schritten von 0,5"):
        assert text in static
    curve = lab(open_address(curves.url() + address), 0)
    live = curve.locator(".lab-live")
    expect(live).to_contain_text("x = 0,50\u00a0m")
    expect(live.locator("dd")).to_contain_text("0,75")
    expect(live.locator("svg text", has_text="1,5").first).to_be_visible()
    slider = curve.get_by_label("Steigung")
    expect(slider).to_have_attribute("aria-valuetext", "1,5")
    expect(slider).to_have_value("1.5")
    expect(live.locator("svg text, output, dd", has_text=re.compile(r"\d\.\d"))).to_have_count(0)


def test_link_leads_to_the_same_values_and_place(page: Page, curves: Site) -> None:
    plot = lab(page, PLOT)
    plot.get_by_label("damping").fill("0.3")
    plot.locator(".lab-charts").press("End")
    plot.get_by_role("button", name="Copy link to this state").click()
    expect(page).to_have_url(re.compile("#lab=1.1-lab-1"))
    page.reload()
    plot = lab(page, PLOT)
    expect(plot.get_by_label("damping")).to_have_value("0.3")
    expect(plot.locator(".lab-time")).to_have_text("r = 3.00")
