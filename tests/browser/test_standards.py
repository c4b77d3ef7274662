"""Every kind of page against the standards: HTML, accessibility, no request to anyone else."""

from __future__ import annotations

import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import pytest
from playwright.sync_api import Browser, Page

from support.built_sites import Site
from support.lab_page import until, watched

pytestmark = pytest.mark.browser

MODULES = Path(__file__).parents[2] / "site" / "node_modules"
NAMES = ("real", "full")
KNOWN = {"home", "lesson", "stub", "level", "model", "page", "notfound", "offline"}
"""Kinds of pages that both courses have, whatever others there are."""


def test_the_kinds_are_found(sites: dict[str, Site]) -> None:
    for site in sites.values():
        assert site.kinds().keys() >= KNOWN
        assert len(site.pages()) > len(site.kinds())


# ------------------------------------------------------------------------------------ HTML


def test_the_nu_checker_finds_nothing_on_any_page(sites: dict[str, Site]) -> None:
    """Over HTTP, so that `'self'` in the pages' policy means something; one start for all."""
    java = shutil.which("java")
    assert java is not None, "no java: install Debian's package `default-jre-headless`"
    jar = MODULES / "vnu-jar" / "build" / "dist" / "vnu.jar"
    allow = "-Dnu.validator.servlet.allow-forbidden-hosts=true"
    urls = [site.host.url + path for site in sites.values() for path in site.pages()]
    options = ("--format", "json", "--stdout", "--exit-zero-always")
    command = [java, allow, "-jar", str(jar), *options, *urls]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    messages = json.loads(done.stdout)["messages"]
    assert [(m["url"], m.get("lastLine"), m["message"]) for m in messages] == []


# -------------------------------------------------------------------------------- requests


class Fetched(HTMLParser):
    """What a page has its browser fetch, as addresses."""

    SOURCES = frozenset("script img iframe source video audio embed track input".split())
    LINKS = frozenset({"stylesheet", "icon", "apple-touch-icon", "manifest", "preload", "prefetch"})

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attributes}
        if tag == "link" and self.LINKS & set(given.get("rel", "").split()):
            self.found.append(given["href"])
        if tag in self.SOURCES:
            self.found += [given[name] for name in ("src", "poster") if name in given]
            sets = given.get("srcset", "").split(",")
            self.found += [part.split()[0] for part in sets if part.split()]
        if tag in ("image", "use"):
            self.found += [given[name] for name in ("href", "xlink:href") if name in given]
        if tag == "object":
            self.found.append(given.get("data", ""))


@pytest.mark.parametrize("name", NAMES)
def test_no_page_names_anything_to_fetch_elsewhere(sites: dict[str, Site], name: str) -> None:
    site = sites[name]
    for path in site.pages():
        parser = Fetched()
        parser.feed((site.public / path).read_text(encoding="utf-8"))
        assert len(parser.found) >= 4, "style, scripts, icons"
        own = urlsplit(site.host.url).netloc
        for address in parser.found:
            parts = urlsplit(urljoin(site.host.url + path, address))
            assert parts.netloc == own or parts.scheme == "data", (path, address)


@pytest.mark.parametrize("name", NAMES)
def test_no_page_asks_anyone_else_or_says_anything_to_the_console(
    browsers: dict[str, Browser], sites: dict[str, Site], name: str
) -> None:
    """Every page, then the worker's work; on those with labs the labs run."""
    site = sites[name]
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 900}) as context:
        asked: list[str] = []
        context.on("request", lambda request: asked.append(request.url))
        page, said = watched(context)
        kinds = site.kinds()
        alike = {"stub", "level"}  # pages of a template and a sheet each: one of them is enough
        paths = [p for p in site.pages() if site.kind(p) not in alike or p in kinds.values()]
        for path in paths:
            page.goto(site.url(path))
            until(page, "document.fonts.status === 'loaded'")
            run_labs(page)
        page.goto(site.url(kinds["offline"]))
        page.get_by_text("files of the course are here.").wait_for()
        others = [url for url in asked if not url.startswith((site.host.url, "blob:", "data:"))]
        assert others == []
        assert [text for text in said if "404" not in text] == []
        assert len(asked) > 3 * len(paths)


STARTED = """n => {
  const lab = document.querySelectorAll('main [data-lab][data-config]')[n]
  return lab.querySelector('.lab-live') !== null && lab.dataset.state !== 'loading'
}"""


def run_labs(page: Page) -> None:
    """Bring every lab of a page into the window and wait until it has started."""
    labs = page.locator("main [data-lab][data-config]")
    for number in range(labs.count()):
        if labs.nth(number).is_visible():
            labs.nth(number).scroll_into_view_if_needed()
            until(page, STARTED, number)


@pytest.mark.parametrize("name", NAMES)
def test_every_kind_of_page_opens_from_disk(
    browsers: dict[str, Browser], sites: dict[str, Site], name: str
) -> None:
    """Without a word to the console; what cannot work from there says so."""
    site = sites[name]
    with browsers["webgl"].new_context(viewport={"width": 1000, "height": 900}) as context:
        page, said = watched(context)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        for kind, path in site.kinds().items():
            if kind == "notfound":  # it is served at any address, and names its files for that
                continue
            page.goto((site.public / path).as_uri())
            until(page, "document.fonts.status === 'loaded'")
            assert page.locator("[data-tools] select").count() >= 1, f"{kind}: its script ran"
            for lab in page.locator("main [data-lab][data-config]").all():
                assert "when the page comes from a web server" in (lab.text_content() or "")
            assert said == [], kind
        page.wait_for_timeout(2000)
        assert said == []
        assert all(url.startswith(("file:", "blob:", "data:")) for url in asked)


# --------------------------------------------------------------------------- accessibility

AXE = """axe.run(document, {rules: {"color-contrast-enhanced": {enabled: true}}}).then(found =>
    found.violations.map(v => [v.id, v.nodes[0].html, v.nodes[0].failureSummary]))"""
WHOLE = """() => {
  // All of the page, folded or far below.
  document.documentElement.style.setProperty('--below', 'visible')
  for (const one of document.querySelectorAll('details')) one.open = true
}"""
SETTINGS = [(scheme, width) for scheme in ("light", "dark") for width in (360, 1440)]


def axe(page: Page) -> list[Any]:
    """What axe finds, with text at 7 : 1, which is more than it asks for by itself."""
    if not page.evaluate("'axe' in window"):
        page.evaluate((MODULES / "axe-core" / "axe.min.js").read_text(encoding="utf-8"))
    found: list[Any] = page.evaluate(AXE)
    return found


@pytest.mark.parametrize(("scheme", "width"), SETTINGS)
@pytest.mark.parametrize("name", NAMES)
def test_axe_finds_nothing_on_any_kind_of_page(
    browsers: dict[str, Browser], sites: dict[str, Site], name: str, scheme: Any, width: int
) -> None:
    site = sites[name]
    viewport: Any = {"width": width, "height": 900}
    with browsers["plain"].new_context(
        viewport=viewport, color_scheme=scheme, bypass_csp=True
    ) as context:
        page = context.new_page()
        for kind, path in site.kinds().items():
            page.goto(site.url(path))
            page.evaluate(WHOLE)
            assert axe(page) == [], kind
            assert page.evaluate("document.documentElement.scrollWidth") <= width, kind


@pytest.mark.parametrize(("scheme", "width"), [("light", 1440), ("dark", 360)])
def test_axe_finds_nothing_in_what_scripts_add(
    browsers: dict[str, Browser], sites: dict[str, Site], scheme: Any, width: int
) -> None:
    """The search while it is open, questions that were answered, a notice."""
    viewport: Any = {"width": width, "height": 900}
    with browsers["plain"].new_context(
        viewport=viewport, color_scheme=scheme, bypass_csp=True
    ) as context:
        page = context.new_page()
        page.goto(sites["full"].url(sites["full"].kinds()["lesson"]))
        page.locator(".search-open").wait_for(state="attached")
        page.keyboard.press("Control+k")
        dialog = page.locator("dialog[open]")
        dialog.wait_for()
        page.keyboard.type("number")
        dialog.get_by_role("option").or_(dialog.get_by_role("link")).first.wait_for()
        assert axe(page) == [], "the search"
        page.keyboard.press("Escape")
        dialog.wait_for(state="detached")
        answered = 0
        for question in page.locator(".question:visible").all():
            question.scroll_into_view_if_needed()
            question.locator("button:visible").first.wait_for()
            choice = question.locator("input[type=radio]:visible, input[type=checkbox]:visible")
            if choice.count():
                choice.first.check()
            elif question.locator("input:visible").count():
                question.locator("input:visible").first.fill("1")
            question.locator("button[type=submit]:visible, button:visible").last.click()
            answered += 1
        assert answered > 3
        until(page, "document.querySelectorAll('.verdict').length > 2")
        page.evaluate(WHOLE)
        assert axe(page) == [], "questions"
