"""Labs with a page of their own: motion that is not welcome, goals, and what goes wrong."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

import pytest
from playwright.sync_api import Browser, BrowserContext, Route, expect

from support.axe import violations
from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import (
    ALL,
    AUTO,
    MOUNT,
    PAGE,
    SWING,
    fetch_text,
    floats,
    has_been,
    lab,
    note_changes,
    parse_link,
    press,
    reach,
    state_of,
    time_of,
    wait_for_change,
    wait_for_condition,
    wait_until_still,
    watch_page,
)

pytestmark = pytest.mark.browser


def test_motion_that_is_not_welcome_begins_with_a_press_or_a_move(
    browsers: Mapping[str, Browser], base: str
) -> None:
    with browsers["webgl"].new_context(reduced_motion="reduce") as context:
        page, _ = watch_page(context)
        page.goto(base + PAGE)
        lab_element = lab(page, AUTO)
        press(lab_element, "One step")
        # Had it run before, this were not its first step.
        assert state_of(page, lab_element)["n"] == 1
        expect(lab_element).to_have_attribute("data-state", "paused")
        press(lab_element, "Kick")
        reach(page, AUTO, "playing")
        swing = lab(page)
        swing.get_by_label("gravity").fill("5")
        reach(page, SWING, "playing")


def test_button_and_values_have_their_room_before_the_lab_plays(
    browsers: Mapping[str, Browser], base: str
) -> None:
    def answer(route: Route) -> None:
        config = route.fetch().json()
        config["start"] = config["controls"][2]["label"] = "Push it from the left"
        route.fulfill(json=config)

    widths = "e => ['.lab-play', '.lab-live dd'].map((part) => e.querySelector(part).offsetWidth)"
    with browsers["plain"].new_context(service_workers="block") as context:
        context.route(re.compile(r"/labs/[^/]*lab-1\.[0-9a-f]+\.json$"), answer)
        page, _ = watch_page(context)
        page.goto(base + PAGE)
        swing = lab(page, SWING, None)
        expect(swing.locator(".lab-play")).to_have_text("Push it from the left")
        room = swing.evaluate(widths)
        swing.locator(".lab-view").press("Space")
        expect(swing.locator(".lab-live dd").first).to_contain_text(re.compile(r"\d"))
        expect(swing.locator(".lab-play")).to_have_text("Pause")
        assert swing.evaluate(widths) == room


def test_one_quantity_is_plotted_against_another(context: BrowserContext, base: str) -> None:
    page, console = watch_page(context)
    page.goto(base + PAGE)
    itself = lab(page, AUTO, "playing")
    plot = itself.locator(".lab-live").get_by_role("img", name="rate (rad/s) against angle (rad)")
    expect(plot.locator(".lab-trace")).to_have_attribute("d", re.compile(r"^M.*L"))
    expect(plot).to_contain_text("angle (rad)")
    press(itself, "Pause")
    end = time_of(itself)
    path = plot.locator(".lab-trace").get_attribute("d") or ""
    places = re.findall(r"([\d.]+) ([\d.]+)", path)
    x, y = map(float, places[len(places) // 2])
    plot.click(position={"x": x, "y": y})
    wait_for_condition(page, lambda: time_of(itself) < end)
    with page.expect_download() as download:
        press(itself, "Curves as CSV")
    rows = download.value.path().read_text().splitlines()
    assert rows[0] == "time (s),rate: rate (rad/s),angle (rad),height: height (m)"
    assert len(rows) > 2
    curves = itself.locator(".lab-live")
    height = curves.get_by_role("img", name="height (m) against")
    path = height.locator(".lab-trace").get_attribute("d")
    menu = itself.get_by_label("Curves over")
    menu.select_option("rate: rate (rad/s)")
    for name in ("height (m)", "rate (rad/s)"):
        drawing = curves.get_by_role("img", name=f"{name} against rate: rate (rad/s)")
        expect(drawing.locator(".lab-trace")).to_have_attribute("d", re.compile(r"^M.*L"))
    expect(height.locator(".lab-trace")).not_to_have_attribute("d", path or "")
    press(itself, "Keep this run")
    expect(height.locator(".lab-ghost")).to_have_attribute("d", re.compile("L"))
    menu.select_option("time (s)")
    expect(height).to_have_accessible_name("height (m) against time (s): height")
    expect(height.locator(".lab-trace")).to_have_attribute("d", path or "")
    expect(plot).to_be_visible()
    assert violations(page, ".lab") == []
    assert console == []


def test_on_a_desk_picture_curves_and_controls_share_a_screen(
    browsers: Mapping[str, Browser], base: str
) -> None:
    size = {"width": 1440, "height": 900}
    with browsers["plain"].new_context(viewport=size) as context:  # type: ignore[arg-type]
        page, _ = watch_page(context)
        page.goto(base + PAGE)
        swing = lab(page, SWING, None)
        parts = [".lab-view", ".lab-play", ".lab-live .lab-plot", ".lab-slider", ".lab-live dd"]
        boxes = {part: swing.locator(part).first.bounding_box() for part in parts}
        view, play, *parts_beside = (box for box in boxes.values() if box)
        assert len(parts_beside) == 3, boxes
        assert view["width"] > 480 and play["y"] > view["y"] + view["height"]
        for box in parts_beside:
            assert box["x"] > view["x"] + view["width"], boxes
        height = max(box["y"] + box["height"] for box in (play, *parts_beside)) - view["y"]
        assert height < 760, boxes
        tape, side = (swing.locator(part).bounding_box() for part in (".lab-tape", ".lab-side"))
        assert tape and side
        assert play["y"] - view["y"] - view["height"] < 16, "the picture reaches to Play"
        hole = side["y"] + side["height"] - tape["y"] - tape["height"]
        assert hole < 1, "the picture grows until there is none under the tape"
        page.set_viewport_size({"width": 1000, "height": 800})
        plot = swing.locator(".lab-live .lab-plot").first.bounding_box()
        view_below = swing.locator(".lab-view").bounding_box()
        assert plot and view_below and plot["y"] > view_below["y"] + view_below["height"]


def test_a_symbol_in_a_formula_lights_what_a_lab_draws_for_it(
    context: BrowserContext, base: str
) -> None:
    page, console = watch_page(context)
    # High enough for the lab and the formula: a picture that has to scroll loses the pointer.
    page.set_viewport_size({"width": 1000, "height": 2000})
    page.goto(base + PAGE)
    zoo = lab(page, ALL, None)
    press(zoo, "One step")
    reach(page, ALL, "paused")
    view, entry = zoo.locator(".lab-view"), zoo.locator(".lab-legend > li")
    bare = wait_until_still(page, view)
    symbol, base_symbol = (
        page.locator(f"p:has-text('are no') {tag} > mi").first for tag in ("msup", "msub")
    )
    symbol.hover()
    for lit in (symbol, entry, zoo.locator("label", has_text="body frames")):
        expect(lit).to_have_attribute("data-lit", "")
    wait_for_change(page, view, bare)
    base_symbol.hover()
    expect(page.locator("[data-lit]")).to_have_count(0)
    wait_for_condition(page, lambda: view.screenshot() == bare)
    zoo.get_by_label("body frames").focus()
    expect(symbol).to_have_attribute("data-lit", "")
    assert console == []


def test_page_keeps_its_place_while_a_picture_arrives_late(
    browsers: Mapping[str, Browser], site: str
) -> None:
    with browsers["plain"].new_context() as context:
        late: list[Route] = []
        context.route(re.compile(r"stone[^/]*\.svg$"), lambda route: late.append(route))
        page, _ = watch_page(context)
        page.goto(site + "lessons/1.2-fall.html", wait_until="domcontentloaded")
        quiz = page.locator("[data-quiz]").first
        picture = page.locator(".figure > img:visible, p > img:visible").first
        wait_for_condition(page, lambda: late != [])
        assert picture.bounding_box() is not None
        assert picture.evaluate("(img) => [img.clientWidth, img.clientHeight]") == [9, 9]
        for route in late:
            route.continue_()
        wait_for_condition(page, lambda: picture.evaluate("(img) => img.naturalWidth") == 9)
        assert picture.evaluate("(img) => [img.clientWidth, img.clientHeight]") == [9, 9]
        expect(quiz).to_be_attached()


def test_a_plot_grows_with_the_size_of_texts_and_keeps_its_colours_in_high_contrast(
    browsers: Mapping[str, Browser], base: str
) -> None:
    larger = "document.documentElement.style.fontSize = '32px'"
    with browsers["plain"].new_context(forced_colors="active") as context:
        context.add_init_script(f"addEventListener('DOMContentLoaded', () => {{ {larger} }})")
        page, _ = watch_page(context)
        page.goto(base + PAGE)
        plot = lab(page, SWING, None).locator(".lab-live .lab-plot").first
        expect(plot).to_have_css("height", "340px")
        expect(plot.locator("text").first).to_have_css("font-size", "24px")
        expect(plot.locator(".lab-trace").first).to_have_css("stroke", "rgb(0, 114, 178)")


# ------------------------------------------------------------------------------- the goal


def test_goal_is_reached_kept_and_its_motion_shown_to_others(
    browsers: Mapping[str, Browser], base: str
) -> None:
    with browsers["webgl"].new_context(has_touch=True) as context:
        page, console = watch_page(context)
        page.goto(base + PAGE)
        swing = lab(page)
        goal = swing.locator(".lab-live .lab-goal")
        expect(goal).to_contain_text("Push it over the top.")
        expect(goal).to_contain_text("0.00 s of 0.2 s")
        swing.get_by_role("button", name="Push").tap()
        page.keyboard.press("Enter")  # a second push
        swing.get_by_role("button", name="Play").tap()
        expect(goal).to_contain_text(re.compile(r"Reached at 0\.\d\d s\."))
        expect(swing.locator(".lab-announce")).to_have_text(re.compile(r"^Reached at 0\."))
        assert violations(page, ".lab") == []
        press(swing, "Pause")
        state = state_of(page, swing)
        assert state["l"] == [[9.8, 2.5, None], [[0, 2], [0, 2]]]
        link = page.evaluate("() => location.href")

        second_page, also_said = watch_page(context)
        second_page.goto(link)
        again = lab(second_page)
        expect(again.locator(".lab-live .lab-goal")).to_contain_text("Reached before.")
        note_changes(again)
        press(again, "Play the motion of this link")
        has_been(again, "playing")
        reach(second_page, SWING, "paused")
        shown_state = state_of(second_page, again)
        assert (shown_state["n"], shown_state["l"]) == (state["n"], state["l"])
        assert floats(shown_state).tobytes() == floats(state).tobytes()
        second_page.goto(base + "progress/index.html")
        expect(second_page.locator('[data-progress="overall"]')).to_contain_text("1 of 1 task done")
        assert [*console, *also_said] == []


def test_run_that_stopped_by_itself_is_gone_through_kept_and_repeated(
    context: BrowserContext, base: str
) -> None:
    def answer(route: Route) -> None:
        route.fulfill(json=json.loads(fetch_text(route)) | {"stopAt": 1})

    context.route(re.compile(r"/labs/[^/]*lab-1\.[0-9a-f]+\.json$"), answer)
    page, console = watch_page(context)
    page.goto(base + PAGE)
    swing = lab(page)
    bar, clock = swing.get_by_label("Time of the run"), swing.locator(".lab-time")

    def play_to_the_end() -> dict[str, object]:
        note_changes(swing)
        press(swing, "Play")
        has_been(swing, "playing")
        reach(page, SWING, "paused")
        expect(clock).to_have_text("1.000 s")
        return state_of(page, swing)

    last = play_to_the_end()
    assert last["n"] == 500
    expect(swing.locator(".lab-announce")).to_have_text("Stopped at 1.00 s.")
    press(swing, "One step back")
    expect(clock).to_have_text("0.998 s")
    press(swing, "One step")
    expect(clock).to_have_text("1.000 s")
    assert state_of(page, swing) == last
    plot = swing.locator(".lab-live .lab-plot")
    value, ghost = plot.locator(".lab-over").last, plot.locator(".lab-ghost")
    expect(value).to_be_hidden()
    plot.hover(position={"x": 60, "y": 60})
    expect(value).to_be_visible()
    bar.fill("0.5")
    expect(clock).to_have_text("0.500 s")
    plot.click(position={"x": 60, "y": 60})
    wait_for_condition(page, lambda: 0 < time_of(swing) < 0.5)
    with page.expect_download() as download:
        press(swing, "Curves as CSV")
    rows = download.value.path().read_text().splitlines()
    assert rows[:2] == ["time (s),angle: angle (rad)", "0,2.5"]
    assert float(rows[-1].split(",")[0]) == pytest.approx(1, abs=0.1)
    bar.press("End")
    expect(clock).to_have_text("1.000 s")
    press(swing, "Keep this run")
    bar.fill("0.5")
    expect(clock).to_have_text("0.500 s")
    assert play_to_the_end() == last
    press(swing, "Reset")
    expect(clock).to_have_text("0.000 s")
    expect(bar).to_be_disabled()
    expect(ghost).to_have_attribute("d", re.compile("L"))
    press(swing, "Drop the kept run")
    expect(ghost).not_to_have_attribute("d", re.compile("L"))
    expect(swing.get_by_role("button", name="Keep this run")).to_be_visible()
    assert play_to_the_end() == last
    note_changes(swing)
    press(swing, "Play")  # goes on from there
    has_been(swing, "playing")
    wait_for_condition(page, lambda: time_of(swing) > 1)
    press(swing, "Pause")
    reach(page, SWING, "paused")
    bar.fill("1")
    expect(clock).to_have_text("1.000 s")
    assert floats(state_of(page, swing)).tobytes() == floats(last).tobytes()
    assert console == []


# ------------------------------------------------------------------------- what goes wrong


def test_state_too_large_for_a_link_is_told(context: BrowserContext, base: str) -> None:
    page, console = watch_page(context)
    page.goto(base + PAGE)
    page.evaluate(MOUNT, SWING)
    page.evaluate(
        """async () => {
          const physics = Float64Array.from({ length: 9000 }, Math.random)
          await window.made.share({ values: [3, 0.5, null], steps: 7, time: 1, physics })
        }"""
    )
    message = page.locator("#tried .lab-message")
    expect(message).to_contain_text("lab.live.link_controls")
    expect(message).to_have_class(re.compile(r"\blab-is-warning\b"))
    state = parse_link(page.evaluate("() => location.href"))
    assert (state["v"], state["physics"]) == ([3, 0.5, None], b"")
    assert console == []


BAD_PUSH = fixture_text("scripts/bad_push.js")


def test_divergence_and_errors_of_lab_code_are_told_and_it_goes_on(
    context: BrowserContext, base: str
) -> None:
    def answer(route: Route) -> None:
        route.fulfill(
            body=fetch_text(route) + BAD_PUSH, headers={"content-type": "text/javascript"}
        )

    context.route(re.compile(r"/labs/[^/]*lab-1\.[0-9a-f]+\.js$"), answer)
    page, _ = watch_page(context)
    page.goto(base + PAGE)
    swing = lab(page)
    press(swing, "Play")
    wait_for_condition(page, lambda: time_of(swing) > 0)
    height = swing.evaluate("e => e.offsetHeight")
    press(swing, "Push")
    message = swing.locator(".lab-message:visible")
    expect(message).to_have_text(re.compile(r"^Diverged at t = \d+\.\d\d s: "))
    assert swing.evaluate("e => e.offsetHeight") == height
    reach(page, SWING, "paused")
    press(swing, "Play")
    reach(page, SWING, "playing")
    expect(message).to_have_count(0)
    press(swing, "Push")
    expect(message).to_contain_text("controls[2].run (“Push”)")
    expect(message).to_contain_text("no rope")


def test_without_webgl_everything_else_works(browsers: Mapping[str, Browser], base: str) -> None:
    with browsers["plain"].new_context() as context:
        page = context.new_page()
        page.goto(base + PAGE)
        swing = lab(page)
        expect(swing.locator(".lab-view")).to_contain_text("no WebGL")
        press(swing, "Play")
        expect(swing.locator(".lab-live dd").first).not_to_contain_text("2.500")
        wait_for_condition(page, lambda: time_of(swing) > 0)


def test_from_disk_the_recorded_form_stays(context: BrowserContext, course: Site) -> None:
    page, console = watch_page(context)
    page.goto((course.public / PAGE).as_uri())
    swing = page.locator(".lab").first
    expect(swing.locator(".lab-message")).to_contain_text("http.server")
    expect(swing.locator(".lab-static")).to_be_visible()
    assert console == []


def test_missing_file_is_told(context: BrowserContext, base: str) -> None:
    page, _ = watch_page(context)
    context.route("**/*.mjb", lambda route: route.fulfill(status=404, body=""))
    page.goto(base + PAGE)
    swing = lab(page, SWING, "ended")
    expect(swing.locator(".lab-message:visible")).to_contain_text("404")


def test_what_is_pointed_at_below_a_lab_keeps_its_place_when_the_lab_arrives(
    calm: BrowserContext, base: str
) -> None:
    page, _ = watch_page(calm)
    page.set_viewport_size({"width": 390, "height": 900})
    late: list[Route] = []
    page.route(re.compile(r"/labs/lab\.[0-9a-f]+\.js$"), lambda route: late.append(route))
    page.goto(base + PAGE)
    swing, below = page.locator(".lab").first, page.locator(".lab + div").first
    below.evaluate("(div) => window.scrollBy(0, div.getBoundingClientRect().top - 300)")
    page.mouse.move(195, 600)
    wait_for_condition(page, lambda: late != [])
    place = "(element) => element.getBoundingClientRect().top"
    top, height = below.evaluate(place), swing.evaluate("(lab) => lab.offsetHeight")
    for route in late:
        route.continue_()
    expect(swing.locator(".lab-play")).to_be_attached()
    wait_for_condition(page, lambda: swing.evaluate("(lab) => lab.offsetHeight") > height + 50)
    wait_for_condition(page, lambda: abs(below.evaluate(place) - top) < 1)


def test_lab_of_a_home_page_is_as_high_before_it_starts_as_after(
    calm: BrowserContext, sites: Mapping[str, Site]
) -> None:
    page, _ = watch_page(calm)
    late: list[Route] = []
    page.route(re.compile(r"/labs/lab\.[0-9a-f]+\.js$"), lambda route: late.append(route))
    height = "(lab) => lab.offsetHeight"
    for width, tall in ((1440, 900), (1440, 1600), (1024, 1366)):
        late.clear()
        page.set_viewport_size({"width": width, "height": tall})
        page.goto(sites["real"].url(), wait_until="load")
        wait_for_condition(page, lambda: late != [])
        opening = page.locator(".opening .lab")
        before = opening.evaluate(height)
        for route in late:
            route.continue_()
        expect(opening.locator(".lab-play:visible")).to_be_attached()
        assert opening.evaluate(height) == before, (width, tall)
