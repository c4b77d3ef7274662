"""Pages against the standards: HTML, accessibility, no request to anyone else, safe drawings."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from support import quiz_page
from support.axe import violations
from support.built_sites import Site
from support.hostile_svg import HARMLESS, HOSTILE, mutants
from support.lab_page import WAKE, until, wait_until_settled, watch_page
from support.opened_drawings import Drawings, published_files
from support.scratch_course import ROOT
from support.static_host import Host

VNU = ROOT / "site" / "node_modules" / "vnu-jar" / "build" / "dist" / "vnu.jar"
NAMES = ("real", "full")
COMMON_KINDS = {"home", "lesson", "level", "model", "page", "notfound", "offline"}
"""Kinds of pages that both courses have, whatever others there are."""
WINDOW: Any = {"width": 1440, "height": 900}
NARROW = (320, 360)


@pytest.mark.browser
def test_every_kind_of_page_is_found(sites: Mapping[str, Site]) -> None:
    for site in (sites[name] for name in NAMES):
        assert site.kinds().keys() >= COMMON_KINDS
        assert len(site.pages()) > len(site.kinds())
    assert "stub" in sites["full"].kinds(), "the page of a planned lesson"


# ------------------------------------------------------------------------------------ HTML


@pytest.fixture
def live_quizzes(context: BrowserContext, quizzes: str, tmp_path: Path) -> str:
    """A page as scripts leave it when every kind of question was answered."""
    page = context.new_page()
    quiz_page.visit(page, quizzes + quiz_page.PATH)
    quiz_page.answer_all(page)
    parts = page.locator(".quiz").evaluate_all("all => all.map(one => one.outerHTML).join('')")
    head = '<!DOCTYPE html><html lang="en"><head><title>Live</title></head><body>'
    file = tmp_path / "live.html"
    file.write_text(f"{head}<h1>Live</h1>{parts}</body></html>", encoding="utf-8")
    return str(file)


@pytest.fixture
def launch_page(scorm: Path) -> Iterator[str]:
    with Host(scorm) as host:
        yield f"{host.url}sco/1.1-one.html"


@pytest.mark.long
@pytest.mark.browser
def test_nu_checker_finds_nothing(
    sites: Mapping[str, Site], live_quizzes: str, launch_page: str
) -> None:
    """Over HTTP, so that `'self'` in the pages' policy means something; one start for all."""
    java = shutil.which("java")
    assert java is not None, "no java: install Debian's package `default-jre-headless`"
    allow = "-Dnu.validator.servlet.allow-forbidden-hosts=true"
    urls = [sites[name].url() + path for name in NAMES for path in sites[name].unlike_pages()]
    options = ("--format", "json", "--stdout", "--exit-zero-always")
    command = [java, allow, "-jar", str(VNU), *options, *urls, live_quizzes, launch_page]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    messages = json.loads(process.stdout)["messages"]
    assert [(m["url"], m.get("lastLine"), m["message"]) for m in messages] == []


# -------------------------------------------------------------------------------- requests


class FetchedAddresses(HTMLParser):
    """What a page has its browser fetch, as addresses."""

    SOURCES = frozenset("script img iframe source video audio embed track input".split())
    LINKS = frozenset({"stylesheet", "icon", "apple-touch-icon", "manifest", "preload", "prefetch"})

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attributes}
        if tag == "link" and self.LINKS & set(values.get("rel", "").split()):
            self.found.append(values["href"])
        if tag in self.SOURCES:
            self.found += [values[name] for name in ("src", "poster") if name in values]
            sets = values.get("srcset", "").split(",")
            self.found += [part.split()[0] for part in sets if part.split()]
        if tag in ("image", "use"):
            self.found += [values[name] for name in ("href", "xlink:href") if name in values]
        if tag == "object":
            self.found.append(values.get("data", ""))


@pytest.mark.browser
@pytest.mark.parametrize("name", NAMES)
def test_no_page_names_anything_to_fetch_elsewhere(sites: Mapping[str, Site], name: str) -> None:
    site = sites[name]
    host = urlsplit(site.host.url).netloc
    elsewhere = []
    for path in site.pages():
        parser = FetchedAddresses()
        parser.feed((site.public / path).read_text(encoding="utf-8"))
        assert len(parser.found) >= 4, "style, scripts, icons"
        for address in parser.found:
            parts = urlsplit(urljoin(site.host.url + path, address))
            if parts.netloc != host and parts.scheme != "data":
                elsewhere.append((path, address))
    assert elsewhere == []


# ------------------------------------------------------------------------- in the browser

LAB_IS_THERE = """n => {
  const lab = document.querySelectorAll('main [data-lab][data-config]')[n]
  const plays = lab.querySelector('.lab-transport') !== null
  return lab.querySelector('.lab-live') !== null && (!plays || lab.dataset.state !== undefined)
}"""
LAB_HAS_STARTED = """n => {
  const lab = document.querySelectorAll('main [data-lab][data-config]')[n]
  return !['loading', 'asleep'].includes(lab.dataset.state)
}"""
WHOLE = """() => {
  // All of the page, folded or far below.
  document.documentElement.style.setProperty('--below', 'visible')
  for (const one of document.querySelectorAll('details')) one.open = true
}"""


def run_labs(page: Page) -> None:
    """Bring every lab of a page into the window and wait until it has started."""
    labs = page.locator("main [data-lab][data-config]")
    for number in range(labs.count()):
        if labs.nth(number).is_visible():
            labs.nth(number).scroll_into_view_if_needed()
            until(page, LAB_IS_THERE, number)
            labs.nth(number).evaluate(WAKE)
            until(page, LAB_HAS_STARTED, number)


@pytest.mark.browser
@pytest.mark.parametrize("name", NAMES)
def test_every_kind_of_page_keeps_the_standards(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site], name: str
) -> None:
    """Labs run and axe looks in the course of every construct: the other one only has more."""
    kinds = sites[name].kinds()
    paths = list(kinds.values()) if name == "full" else [kinds["home"], kinds["lesson"]]
    keeps_the_standards(browsers["webgl"], sites[name], paths, closely=name == "full")


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_page_keeps_the_standards(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site], name: str
) -> None:
    paths = list(sites[name].unlike_pages())
    keeps_the_standards(browsers["webgl"], sites[name], paths, closely=True)


def keeps_the_standards(browser: Browser, site: Site, paths: list[str], closely: bool) -> None:
    """Axe finds nothing, no narrow window is too narrow, nothing is said, nobody else is asked."""
    failures: list[Any] = []
    with browser.new_context(viewport=WINDOW) as context:
        requests: list[str] = []
        context.on("request", lambda request: requests.append(request.url))
        page, console = watch_page(context)
        for path in paths:
            page.goto(site.url(path))
            wait_until_settled(page)
            if closely:
                run_labs(page)
            page.evaluate(WHOLE)
            if closely:
                failures += [(path, violation) for violation in violations(page)]
            for width in NARROW:
                page.set_viewport_size({"width": width, "height": 900})
                until(page, "document.documentElement.scrollWidth <= innerWidth")
            page.set_viewport_size(WINDOW)
        page.goto(site.url(site.kinds()["offline"]))
        expect(page.get_by_text("files to be kept are here.")).to_be_visible()
        foreign = [url for url in requests if not url.startswith((site.host.url, "blob:", "data:"))]
        assert failures + foreign + [text for text in console if "404" not in text] == []
        assert len(requests) > 3 * len(paths)


@pytest.mark.browser
def test_every_kind_of_page_opens_from_disk(
    browsers: Mapping[str, Browser], sites: Mapping[str, Site]
) -> None:
    """Without a word to the console; what cannot work from there says so."""
    site = sites["full"]
    with browsers["webgl"].new_context(viewport=WINDOW) as context:
        page, console = watch_page(context)
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        for kind, path in site.kinds().items():
            if kind == "notfound":  # it is served at any address, and names its files for that
                continue
            page.goto((site.public / path).as_uri())
            wait_until_settled(page)
            for lab in page.locator("main [data-lab][data-config]").all():
                expect(lab).to_contain_text("when the page comes from a web server")
        assert console == []
        assert all(url.startswith(("file:", "blob:", "data:")) for url in requests)


ACTIVE = (
    *("script", "XHTML script", "XHTML frame", "XHTML picture", "onclick", "set of a link"),
    *("animate of a picture", "a link elsewhere", "image from afar", "stylesheet from afar"),
    *("style: fill:u\\72l(FAR/x.svg#x)", "style: background-image:image-set('FAR/i.png' 1x)"),
)
"""Some that act where nobody judges them, so that it is known what the probe sees."""


@pytest.fixture(scope="module")
def drawings(
    browsers: Mapping[str, Browser], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Drawings]:
    with Drawings(browsers["plain"], tmp_path_factory.mktemp("drawings")) as drawings:
        yield drawings


def test_hostile_drawings_act_where_nobody_judges_them(drawings: Drawings) -> None:
    files = dict(HOSTILE)
    assert [name for name in ACTIVE if not drawings.open(files[name])] == []


@pytest.mark.long
def test_a_published_drawing_runs_nothing_and_asks_nobody(drawings: Drawings) -> None:
    files = {name: published_files(data) for name, data in (*HOSTILE, *mutants(400, seed=36))}
    assert sum(not files[name] for name, _ in HOSTILE) > 250, "these are refused"
    files |= {name: published_files(data)[:1] for name, data in HARMLESS}
    traces = {name: [drawings.open(data) for data in versions] for name, versions in files.items()}
    assert sum(map(len, traces.values())) > 25, "these are opened"
    assert {name: traces[name] for name in files if any(traces[name])} == {}
