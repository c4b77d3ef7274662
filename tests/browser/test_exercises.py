"""Exercises: what a reader writes is judged, whatever it is, and harms nothing."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from support.axe import violations
from support.built_sites import Site
from support.fixture_cases import fixture_tables, fixture_text
from support.lab_page import press, until, wait_for_condition, watch_page

pytestmark = pytest.mark.browser

ADDRESS = "lessons/1.1-one.html"
HURRY = """() => {
  const set = window.setTimeout
  window.setTimeout = (action, ms) => set(action, ms === 10_000 ? 500 : ms)
  return () => { window.setTimeout = set }
}"""
"""Shortens the patience with a trial; gives what makes it long again."""
COUNT_BLOBS = """
  const { createObjectURL: create, revokeObjectURL: revoke } = URL
  window.blobs = new Set()
  URL.createObjectURL = (blob) => {
    const address = create(blob)
    window.blobs.add(address)
    return address
  }
  URL.revokeObjectURL = (address) => window.blobs.delete(address) && revoke(address)"""
REACH = fixture_text("scripts/reach.js")
HOLDS = "document.documentElement.scrollWidth <= window.innerWidth"


@pytest.fixture(scope="module")
def page(browsers: Mapping[str, Browser], sites: Mapping[str, Site]) -> Iterator[Page]:
    """A phone's window in the dark; in its console only what the policy refuses may appear."""
    size = {"width": 390, "height": 800}
    with browsers["webgl"].new_context(viewport=size, color_scheme="dark") as context:  # type: ignore[arg-type]
        page, console = watch_page(context)
        page.add_init_script(COUNT_BLOBS)
        page.goto(sites["exercises"].url(ADDRESS))
        yield page
        assert [line for line in console if "/x.js" not in line] == []


def exercise(page: Page, title: str) -> tuple[Locator, Locator]:
    """An exercise, and the field of its text."""
    element = page.locator(".exercise").filter(has=page.locator(".lab-title", has_text=title))
    element.scroll_into_view_if_needed()
    return element, element.get_by_role("textbox")


def verdicts(element: Locator) -> Locator:
    return element.get_by_role("list").get_by_role("listitem")


def test_attempts_are_judged_watched_and_kept(page: Page) -> None:
    bar, text = exercise(page, "A bar that balances")
    press(bar, "Check")
    level, mass = verdicts(bar).all()
    expect(level).to_contain_text(re.compile("level failed −27\\.\\d+° was seen"))
    expect(level).to_contain_text("The heavier ball needs the shorter arm.")
    expect(mass).to_contain_text("there passed 1.600 kg was seen")
    expect(bar.get_by_role("status").filter(has_text="1 of 2")).to_be_visible()
    press(level, "Watch this run")
    expect(bar).to_have_attribute("data-state", "paused")
    expect(bar.locator(".lab-time")).to_have_text(re.compile(r"^2\.000* s$"))
    expect(level.locator(".exercise-now")).to_have_text("−27.366°")
    expect(mass.locator(".exercise-now")).to_be_hidden()
    assert violations(page, ".exercise") == []
    until(page, HOLDS)
    start = text.input_value()
    text.fill(start.replace("-0.3 0 0", "-0.15 0 0"))
    text.press("Control+Enter")
    expect(bar.get_by_text("Solved: all trials are passed.")).to_be_visible()
    until(page, "window.blobs.size === 0")
    press(bar, "Back to the start")
    expect(text).to_have_value(start)
    press(bar, "Back to mine")
    expect(text).to_have_value(re.compile("-0.15"))
    page.reload()
    bar, text = exercise(page, "A bar that balances")
    expect(bar.get_by_text("You have solved this exercise before.")).to_be_visible()


def test_the_start_is_seen_before_anything_runs_and_plays_on_a_wide_page(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site]
) -> None:
    with browsers["webgl"].new_context(viewport={"width": 1440, "height": 800}) as context:
        page, _ = watch_page(context)
        addresses: list[str] = []
        page.on("request", lambda request: addresses.append(request.url))
        page.goto(sites["exercises"].url(ADDRESS))
        titles = ("A bar that balances", "Hold it", "A push")
        for element, _ in (exercise(page, title) for title in titles):
            expect(element.locator(".lab-view img")).to_have_js_property("naturalWidth", 640)
        assert not any(address.endswith(".wasm") for address in addresses)
        bar, _ = exercise(page, titles[0])
        press(bar, "Play")
        expect(bar.locator(".lab-view img")).to_have_count(0)
        expect(bar.locator(".lab-time")).not_to_have_text("0.00 s")


def pytest_of(path: Path) -> tuple[int, str]:
    """The exit status and the output of `pytest` on a file, as a reader without plugins runs it."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", path.name]
    plain = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "TMPDIR": str(path.parent)}
    process = subprocess.run(command, cwd=path.parent, env=plain, capture_output=True, text=True)
    return process.returncode, process.stdout


@pytest.mark.parametrize(
    "title, name, start, solution, failures", fixture_tables("trials")["trials"]
)
def test_trials_run_by_pytest_on_a_file_of_the_page(
    page: Page, tmp_path: Path, title: str, name: str, start: str, solution: str, failures: int
) -> None:
    element, _ = exercise(page, title)
    with page.expect_download() as download:
        element.get_by_role("link", name="Download").click()
    assert download.value.suggested_filename == name
    path = tmp_path / name
    download.value.save_as(path)
    status, output = pytest_of(path)
    assert (status, f"{failures} failed" in output) == (1, True), output
    text = path.read_text()
    assert text.startswith("# /// script\n") and start in text
    path.write_text(text.replace(start, solution))
    assert pytest_of(path)[0] == 0
    expect(element).to_contain_text(f"python {name}")
    command = [sys.executable, "-I", name]  # as `uv run` does
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (process.returncode, "failed:" in process.stdout) == (0, False), process.stdout


def test_a_model_that_does_not_compile_is_told_at_its_line(page: Page) -> None:
    bar, text = exercise(page, "A bar that balances")
    text.fill("<mujoco>\n  <worldbody>\n    <geom foo='1'/>\n  </worldbody>\n</mujoco>")
    press(bar, "Check")
    expect(bar.get_by_role("alert").filter(has_text="unrecognized attribute")).to_be_visible()
    expect(text).to_have_accessible_description(re.compile("Line 3: Schema violation"))
    expect(verdicts(bar).first).to_contain_text("not tried yet")
    text.fill("<mujoco/>")
    press(bar, "Check")
    expect(verdicts(bar).first).to_contain_text('no value: Error: the model has no joint "pivot"')


def test_code_without_an_end_or_a_meaning_harms_no_neighbour(page: Page) -> None:
    host = socket.create_server(("127.0.0.1", 0))
    elsewhere = f"http://127.0.0.1:{host.getsockname()[1]}/x.js"
    neighbour = page.locator(".lab").filter(has_text="A neighbour")
    neighbour.scroll_into_view_if_needed()
    press(neighbour, "Play")
    expect(neighbour).to_have_attribute("data-state", "playing")
    hold, text = exercise(page, "Hold it")
    unhurried = page.evaluate_handle(HURRY)
    text.fill("for (;;) {}")
    press(hold, "Check")
    expect(hold.get_by_role("alert").filter(has_text="took too long")).to_be_visible()
    unhurried.evaluate("end => end()")
    for mistake, message in (
        ("data.qpos[0] = ", "Unexpected token"),
        ("}) => {}, ({", ""),
    ):
        text.fill(mistake)
        press(hold, "Check")
        expect(hold.get_by_role("alert").filter(has_text=message)).to_be_visible()
        expect(text).to_have_attribute("aria-invalid", "true")
    text.fill(REACH)
    press(hold, "Check")
    absent = "fetch indexedDB caches navigator XMLHttpRequest WebSocket is not defined"
    expect(verdicts(hold).last).to_contain_text(f"Error: {absent}")
    # Of another size of the model the page would die.
    for attempt, message in (
        ("model.nv = 1e9", "only a getter"),
        (f'ctx.asked ??= import("{elsewhere}")', "was seen"),
        (f'ctx.asked ??= new FontFace("f", "url({elsewhere})").load()', "was seen"),
        ("Math.abs = Math.min = () => 0.5", "Math.abs, Math.min must stay as it was"),
        ("Number.isFinite = () => true; data.qpos[0] = 0.5", "Number.isFinite must stay"),
    ):
        text.fill(attempt)
        press(hold, "Check")
        expect(verdicts(hold).last).to_contain_text(message)
    host.setblocking(False)
    with host, pytest.raises(BlockingIOError):
        host.accept()
    text.fill("self.postMessage({type: 'verdict', index: 0, passed: true, seen: 0, failure: ''})")
    press(hold, "Check")
    for verdict in verdicts(hold).all():
        expect(verdict).to_contain_text("self.postMessage is not a function")
    text.fill("data.qfrc_applied[0] = 50 * (0.5 - data.qpos[0]) - 10 * data.qvel[0]")
    press(hold, "Check")
    expect(hold.get_by_text("Solved: all trials are passed.")).to_be_visible()
    press(verdicts(hold).last, "Watch this run")
    expect(hold.locator(".lab-time")).to_have_text(re.compile(r"^5\.000* s$"))
    expect(hold.locator(".exercise-now").last).to_have_text(re.compile("0.4"))
    neighbour.scroll_into_view_if_needed()
    expect(neighbour).to_have_attribute("data-state", "playing")


def test_a_formula_is_written_as_on_paper(page: Page) -> None:
    push, text = exercise(page, "A push")
    expect(push.get_by_label("Your formula, of h, g")).to_have_value("2*g*h")
    press(push, "Check")
    expect(verdicts(push)).to_contain_text("failed 9.810 m/s was seen")
    text.fill("(2*g*h)^0.5")
    press(push, "Check")
    expect(verdicts(push)).to_contain_text("passed 3.132 m/s was seen")
    text.fill("9,81*h")
    press(push, "Check")
    fault = "The formula cannot be read from here on: ,81*h"
    expect(text).to_have_accessible_description(fault)
    expect(verdicts(push)).to_contain_text("not tried yet")
    text.fill("")
    press(push, "Play")
    expect(text).to_have_accessible_description("Write a formula of h, g.")


@pytest.mark.parametrize("width", [390, 820, 1440])
def test_an_exercise_and_a_first_lab_come_alive_in_the_room_that_was_kept_for_them(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site], width: int
) -> None:
    late: list[Route] = []
    options: dict[str, Any] = {"viewport": {"width": width, "height": 800}}
    options |= {"has_touch": width < 1000, "service_workers": "block"}
    with browsers["plain"].new_context(**options) as context:
        page = context.new_page()
        for address, count in ((ADDRESS, 3), ("", 1)):
            page.route("**/labs/lab.*.js", lambda route: late.append(route))
            page.goto(sites["exercises"].url(address))
            elements = page.locator(".lab:has(.lab-room)").all()
            assert len(elements) == count
            names = [element.get_attribute("data-lab") for element in elements]
            heights = [element.evaluate("e => e.offsetHeight") for element in elements]
            wait_for_condition(page, lambda: late != [])
            while late:
                late.pop().continue_()
            page.unroute_all()
            for name, height in zip(names, heights, strict=True):
                element = page.locator(f'[data-lab="{name}"]')
                element.scroll_into_view_if_needed()
                expect(element).to_have_class(re.compile("lab-on"))
                expect(element.get_by_role("button", name="Play")).to_be_visible()
                assert element.evaluate("e => e.offsetHeight") == height
