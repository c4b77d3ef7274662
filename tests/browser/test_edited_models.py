"""Labs whose model the reader edits: mistakes at their lines, links, and models that never end."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Mapping

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from support.axe import violations
from support.fixture_cases import fixture_tables, fixture_text
from support.lab_page import (
    EDITED_LAB,
    PAGE,
    SWING,
    lab,
    press,
    until,
    wait_for_change,
    wait_for_condition,
    wait_until_still,
    watch_page,
)

pytestmark = pytest.mark.browser

HOLDS = "([part, whole]) => document.querySelector(part).getBoundingClientRect().right <= whole"
ENDLESS = '<option iterations="2000000000" tolerance="0" ls_iterations="9" solver="PGS"/>'
KEEP_BEATS = fixture_text("scripts/keep_beats.js")
"""Keeps what asks a worker from time to time whether it still answers."""
BEAT = "() => beats.at(-1)?.()"


@pytest.fixture(scope="module")
def page(browsers: Mapping[str, Browser], base: str) -> Iterator[Page]:
    """A phone's window, in which the lab is near."""
    with browsers["webgl"].new_context(viewport={"width": 390, "height": 800}) as context:
        page, console = watch_page(context)
        page.add_init_script(KEEP_BEATS)
        page.goto(base + PAGE)
        lab(page, EDITED_LAB)
        yield page
        assert console == []


def editor_of(page: Page) -> tuple[Locator, Locator]:
    lab_element = page.locator(".lab").nth(EDITED_LAB)
    return lab_element, lab_element.get_by_label("The model, as MJCF")


def test_mistakes_are_told_at_their_lines_and_a_mended_model_runs(page: Page) -> None:
    lab_element, text = editor_of(page)
    press(lab_element, "Back to the lesson’s model")
    lesson = text.input_value()
    assert lesson.startswith("<mujoco>")
    mistaken = lesson.replace('<joint axis="0 1 0"', '<joint axle="0 1 0"')
    text.fill(mistaken)
    text.press("Control+Enter")
    alert = lab_element.get_by_role("alert").filter(has_text="Schema violation")
    expect(alert).to_contain_text("unrecognized attribute: 'axle'\nElement 'joint', line 5")
    expect(text).to_have_attribute("aria-invalid", "true")
    expect(text).to_have_accessible_description(re.compile("Line 5: Schema violation"))
    expect(lab_element.locator(".lab-numbers mark")).to_have_text("5")
    assert violations(page, ".lab-editor") == []
    press(lab_element, "Line 5:")
    expect(text).to_be_focused()
    line = text.evaluate("field => field.value.slice(field.selectionStart, field.selectionEnd)")
    assert line.strip() == '<joint axle="0 1 0" range="-20 20"/>'
    text.press("Tab")
    expect(text).not_to_be_focused()
    text.fill(mistaken.replace("axle", "axis").replace("0.06", "0.04"))
    press(lab_element, "Compile and run")
    expect(lab_element).to_have_attribute("data-state", "playing")
    expect(lab_element.locator(".lab-time")).not_to_have_text(re.compile(r"^0\.000* s$"))
    expect(alert).to_be_hidden()
    expect(text).not_to_have_attribute("aria-invalid", "true")
    assert violations(page, ".lab") == []
    for part in (".lab-editor", ".lab-source textarea", ".lab-transport"):
        until(page, HOLDS, [part, 390])
    press(lab_element, "Pause")
    press(lab_element, "Back to the lesson’s model")
    expect(text).to_have_value(lesson)
    expect(lab_element).to_have_attribute("data-state", "playing")
    press(lab_element, "Back to my model")
    expect(text).to_have_value(re.compile("0.04"))
    expect(lab_element).to_have_attribute("data-state", "playing")


CART = fixture_text("documents/cart.xml")
FLOOR = '<geom name="floor" type="plane" size="2 2 1" pos="0 0 -1"/>'
OVERFLOWING = (
    "rows => rows.filter(row => row.scrollWidth > row.clientWidth).map(row => row.innerText)"
)


def test_panel_of_a_model_has_its_actuators_sensors_cameras_and_keyframes(page: Page) -> None:
    lab_element, text = editor_of(page)
    text.fill(CART)
    press(lab_element, "Compile and run")
    expect(lab_element).to_have_attribute("data-state", "playing")
    push = lab_element.get_by_label("push")
    expect(push).to_have_count(0)
    lab_element.get_by_text("Model", exact=True).click()
    expect(push).to_have_attribute("min", "-4")
    expect(push).to_have_attribute("max", "8")
    place = lab_element.locator(".lab-model dd")
    expect(place).to_have_text(re.compile(r"^\s0\.000$"))
    push.fill("4")
    expect(place).to_have_text(re.compile(r"^\s[1-9]\d*\.\d{3}$"))
    lab_element.get_by_label("curve of place").check()
    curve = lab_element.get_by_role("img", name="place")
    expect(curve.locator(".lab-trace")).to_be_visible()
    assert violations(page, ".lab") == []
    press(lab_element, "Pause")
    expect(lab_element).to_have_attribute("data-state", "paused")
    clock = lab_element.locator(".lab-time")
    last_time = clock.inner_text()
    curve.click(position={"x": 50, "y": 60})
    expect(clock).not_to_have_text(last_time)
    lab_element.get_by_label("curve of place").uncheck()
    expect(curve).to_have_count(0)
    press(lab_element, "far")
    expect(place).to_have_text(re.compile(r"^\s3\.000$"))
    expect(push).to_have_attribute("aria-valuetext", "0.000")
    view = lab_element.locator(".lab-view")
    free = wait_until_still(page, view)
    lab_element.get_by_label("Camera", exact=True).select_option(label="behind")
    wait_for_change(page, view, free)
    view.press("ArrowLeft")  # which shows the focus, too
    rear_view = wait_until_still(page, view)
    view.press("ArrowLeft")
    assert wait_until_still(page, view) == rear_view, "no hand turns a camera of the model"
    lab_element.get_by_label("Camera", exact=True).select_option(label="free")
    wait_for_change(page, view, rear_view)
    lab_element.get_by_label("Body, joint or geom").select_option(label="\u2003\u2003joint slide")
    coordinate = lab_element.locator("dt:text-is('qpos') + dd")
    expect(coordinate).to_have_text(re.compile(r"^\s?3$"))
    press(lab_element, "near")
    expect(coordinate).to_have_text(re.compile(r"^\s?0$"))
    text.fill(CART.replace("<body>", f"{FLOOR}<body>"))
    press(lab_element, "Compile and run")
    expect(lab_element).to_have_attribute("data-state", "playing")
    part = lab_element.get_by_label("Body, joint or geom")
    for _ in range(9):  # frames of the part before are still on their way
        part.select_option(label="\u2003\u2003joint slide")
        expect(coordinate).to_be_visible()
        part.select_option(label="\u2003geom floor")
        expect(lab_element.locator("dt:text-is('geom_size') + dd")).to_have_text("2 2 1")
    expect(coordinate).to_have_count(0)
    rows = lab_element.locator(".lab-model dl > div")
    assert rows.evaluate_all(OVERFLOWING) == []
    text.fill("<mujoco/>")
    press(lab_element, "Compile and run")
    expect(push.or_(coordinate)).to_have_count(0)
    expect(lab_element.get_by_label("Body, joint or geom")).to_be_visible()
    lab_element.get_by_text("Model", exact=True).click()


def test_link_carries_the_edited_model(page: Page, base: str) -> None:
    lab_element, text = editor_of(page)
    mine = '<mujoco>\n  <worldbody><geom name="μ" size="0.3"/></worldbody>\n</mujoco>'
    text.fill(mine)
    press(lab_element, "Copy link to this model")
    expect(page).to_have_url(re.compile("#lab=1.1-lab-5&z="))
    second_page = page.context.new_page()
    second_page.goto(page.url)
    linked_lab, its_text = editor_of(second_page)
    expect(its_text).to_have_value(mine)
    expect(linked_lab).to_have_attribute("data-state", "paused")
    expect(linked_lab.locator(".lab-message:visible")).to_have_count(0)
    second_page.close()
    text.fill("".join(str(i**0.5) for i in range(3000)))
    press(lab_element, "Copy link to this model")
    expect(lab_element.get_by_role("alert").filter(has_text="too long for a link")).to_be_visible()


ROBOT = fixture_tables("robot")["files"]
DROP = fixture_text("scripts/drop.js")


def archive(files: Mapping[str, str]) -> bytes:
    """A zip of files."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as packed:
        for path, text in files.items():
            packed.writestr(path, text)
    return content.getvalue()


def test_reader_begins_with_another_model(page: Page) -> None:
    lab_element, text = editor_of(page)
    lab_element.get_by_label("Start from").select_option(label="pendulum")
    expect(text).to_have_value(re.compile('<body name="arm"'))
    expect(lab_element).to_have_attribute("data-state", "playing")
    lab_element.get_by_label("Start from").select_option(label="A lever")
    expect(text).to_have_value(re.compile('range="-20 20"'))
    expect(lab_element).to_have_attribute("data-state", "playing")
    press(lab_element, "Pause")


def test_reader_opens_a_model_with_its_meshes_and_nothing_is_sent(page: Page) -> None:
    lab_element, text = editor_of(page)
    requests: list[str] = []
    page.on("request", lambda request: requests.append(f"{request.method} {request.url}"))
    with page.expect_file_chooser() as chooser:
        press(lab_element, "Open a file")
    chooser.value.set_files(
        {"name": "robot.zip", "mimeType": "application/zip", "buffer": archive(ROBOT)}
    )
    expect(text).to_have_value(ROBOT["robot/scene.xml"])
    expect(lab_element).to_have_attribute("data-state", "playing")
    expect(lab_element.locator(".lab-time")).not_to_have_text(re.compile(r"^0\.000* s$"))
    expect(lab_element.get_by_text("Opened robot/scene.xml, with 2 other files.")).to_be_visible()
    assert violations(page, ".lab") == []
    press(lab_element, "Copy link to this model")
    expect(lab_element.get_by_text("without the files beside it")).to_be_visible()
    press(lab_element, "Back to the lesson’s model")
    expect(text).to_have_value(re.compile('range="-20 20"'))
    press(lab_element, "Back to my model")
    expect(text).to_have_value(ROBOT["robot/scene.xml"])
    expect(lab_element).to_have_attribute("data-state", "playing")
    lab_element.evaluate(DROP, ["cart.xml", list(CART.encode())])
    expect(text).to_have_value(CART)
    expect(lab_element.get_by_label("Start from")).to_have_js_property("selectedIndex", -1)
    expect(lab_element).to_have_attribute("data-state", "playing")
    bare = archive({"scene.xml": ROBOT["robot/scene.xml"]})
    lab_element.evaluate(DROP, ["bare.zip", list(bare)])
    expect(lab_element.get_by_role("alert").filter(has_text="body.xml")).to_be_visible()
    lab_element.evaluate(DROP, ["garbled.zip", [0x50, 0x4B, 3, 4, *range(99)]])
    expect(lab_element.get_by_role("alert").filter(has_text="cannot be read")).to_be_visible()
    assert [request for request in requests if not request.startswith("GET ")] == []


FINE = fixture_text("documents/fine_model.xml")


def test_zip_offers_its_models_and_a_model_too_fine_to_draw_is_drawn_coarser(page: Page) -> None:
    lab_element, text = editor_of(page)
    files = archive({**ROBOT, "fine.xml": FINE})
    lab_element.evaluate(DROP, ["robots.zip", list(files)])
    expect(text).to_have_value(ROBOT["robot/scene.xml"])
    lab_element.get_by_label("Model of these files").select_option(label="fine.xml")
    expect(text).to_have_value(FINE)
    expect(lab_element.get_by_text("Drawn coarser")).to_contain_text("pearl")
    expect(lab_element).to_have_attribute("data-state", "playing")
    press(lab_element, "Back to the lesson’s model")
    expect(lab_element.get_by_text("Drawn coarser")).to_have_count(0)
    expect(lab_element.get_by_label("Model of these files")).to_be_hidden()
    press(lab_element, "Back to my model")
    expect(text).to_have_value(FINE)


def test_every_lab_opens_its_model_in_the_editor(page: Page) -> None:
    swing = lab(page, SWING)
    press(swing, "Open in the editor")
    text = swing.get_by_label("The model, as MJCF")
    expect(text).to_be_focused()
    lesson = text.input_value()
    assert '<body name="arm"' in lesson
    expect(swing.get_by_role("button", name="Push")).to_be_hidden()
    mine = lesson.replace("</worldbody>", '<geom name="mine" size="0.1"/></worldbody>')
    text.fill(mine)
    text.press("Control+Enter")
    expect(swing).to_have_attribute("data-state", "playing")
    assert violations(page, ".lab") == []
    press(swing, "Copy link to this model")
    expect(page).to_have_url(re.compile("#lab=1.1-lab-1&z="))
    second_page = page.context.new_page()
    second_page.goto(page.url)
    linked_lab = lab(second_page, SWING, None)
    expect(linked_lab.get_by_label("The model, as MJCF")).to_have_value(mine)
    second_page.close()
    press(swing, "Back to the lab")
    expect(text).to_have_count(0)
    expect(swing).to_have_attribute("data-state", "paused")
    press(swing, "Push")
    press(swing, "Play")
    expect(swing).to_have_attribute("data-state", "playing")
    press(swing, "Pause")


def test_listing_opens_in_the_editor_of_the_course(page: Page, base: str) -> None:
    second_page = page.context.new_page()
    second_page.goto(base + PAGE)
    listing = second_page.locator(".mjcf")
    part = (listing.locator("code").text_content() or "").strip()
    press(listing, "Open in the editor")
    text = editor_of(second_page)[1]
    model = f"<mujoco><worldbody>\n{part}\n</worldbody></mujoco>"
    expect(text).to_have_value(model)
    text.fill("<mujoco/>")
    press(listing, "Open in the editor")  # once more, by the same address
    expect(text).to_have_value(model)
    second_page.close()


def test_model_that_never_comes_to_an_end_holds_nothing_up(page: Page) -> None:
    lab_element, text = editor_of(page)
    press(lab_element, "Back to the lesson’s model")
    lesson = text.input_value()
    endless = lesson.replace("<worldbody>", f"{ENDLESS}<worldbody>").replace("0 0 0.3", "0 0 0.02")
    text.fill(endless)
    press(lab_element, "Compile and run")
    alert = lab_element.get_by_role("alert").filter(has_text="too long")
    wait_for_condition(page, lambda: page.evaluate(BEAT) or alert.is_visible())
    expect(lab_element).to_have_attribute("data-state", "ended")
    text.fill(endless.replace("0 0 0.02", "0 0 0.019"))
    press(lab_element, "Compile and run")
    press(lab_element, "Back to the lesson’s model")
    expect(text).to_have_value(lesson)
    expect(lab_element).to_have_attribute("data-state", "playing")


def test_model_as_large_as_numbers_go_has_no_scale_bar(page: Page) -> None:
    lab_element, text = editor_of(page)
    text.fill('<mujoco><worldbody><geom size="1e308"/></worldbody></mujoco>')
    press(lab_element, "Compile and run")
    expect(lab_element.locator(".lab-view .lab-scale")).to_be_hidden()
    expect(lab_element).to_have_attribute("data-state", "playing")
