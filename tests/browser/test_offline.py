"""The site without a network: what a browser keeps, when it asks for what, and what it shows."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from coursebuild.core.engine.store import Store
from coursebuild.pipeline.options import Options
from coursebuild.preview.server import PreviewServer
from coursebuild.preview.session import Session
from support.built_sites import Site
from support.fixture_cases import fixture_text
from support.lab_page import PAGE, becomes, lab, until, wait_for_condition, watch_page
from support.scratch_course import Folder
from support.static_host import Host

pytestmark = pytest.mark.browser

PICTURE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 0h9v9z"/></svg>'
TEXTS = ("## One\n\nText of one.\n\n![a sketch](s.svg)\n", "## Two\n\nText of two.\n")
FIRST, SECOND = "lessons/1.1-one.html", "lessons/1.2-two.html"

COUNT_VISIT_MESSAGES = fixture_text("scripts/count_visit_messages.js")
SLOW_STORE = fixture_text("scripts/slow_store.js")
QUIET = fixture_text("scripts/quiet_worker.js")


@pytest.fixture(scope="module")
def offline_course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course, built once; tests that change it copy its site."""
    folder = Folder(tmp_path_factory.mktemp("offline") / "course")
    folder.fill(TEXTS, stores)
    folder.write("content/lessons/s.svg", PICTURE)
    assert folder.main("build").status == 0
    shutil.copytree(folder.root / "public", folder.root / "first")
    return folder


@pytest.fixture
def host(offline_course: Folder, tmp_path: Path) -> Iterator[Host]:
    """Serves a copy of the site, in a folder of its host."""
    shutil.copytree(offline_course.root / "first", tmp_path / "site")
    with Host(tmp_path / "site", "/course/") as host:
        yield host


def settle(page: Page) -> None:
    """Wait until the worker has done all it was told to, after one visit more."""
    page.evaluate(QUIET)


def settled_page(context: BrowserContext, host: Host, path: str = "") -> tuple[Page, list[str]]:
    """A page whose worker has kept what it keeps."""
    page, console = watch_page(context)
    page.goto(host.url + path)
    page.evaluate("navigator.serviceWorker.ready.then(() => 0)")
    worker_address = (
        "new URL(document.documentElement.dataset.root + 'service-worker.js', document.baseURI)"
    )
    until(page, f"navigator.serviceWorker.controller?.scriptURL === {worker_address}.href")
    settle(page)
    return page, console


def visited(page: Page, host: Host, path: str) -> None:
    page.add_init_script(COUNT_VISIT_MESSAGES)
    page.goto(host.url + path)
    until(page, "window.toldOfVisits > 0")
    settle(page)


def see(page: Page, text: str) -> None:
    expect(page.get_by_text(text)).to_be_visible()


def build_edited(offline_course: Folder, site: Path, *edits: tuple[str, str, str]) -> None:
    for path, old, new in edits:
        offline_course.replace(path, old, new)
    try:
        assert offline_course.main("build").status == 0
        shutil.rmtree(site)
        shutil.copytree(offline_course.root / "public", site)
    finally:
        for path, old, new in edits:
            offline_course.replace(path, new, old)


@pytest.fixture(scope="module")
def stored_page(
    browsers: Mapping[str, Browser], offline_course: Folder
) -> Iterator[tuple[Page, Host]]:
    """A page of a site that was visited once, and that the tests leave as it is."""
    with (
        Host(offline_course.root / "first", "/course/") as host,
        browsers["plain"].new_context() as context,
    ):
        page, console = settled_page(context, host)
        assert console == []
        yield page, host


def test_every_page_is_there_without_a_network_after_one_visit(
    stored_page: tuple[Page, Host],
) -> None:
    page, host = stored_page
    with host.away():
        for path, text in ((FIRST, "Text of one."), (SECOND, "Text of two."), ("", "Lesson one")):
            page.goto(host.url + path)
            expect(page.locator("main").get_by_text(text).first).to_be_visible()
            expect(page.locator("body")).to_have_css("display", "flex")  # its style
            expect(page.locator("[data-tools] select")).to_have_count(1)  # its script
            until(page, "document.fonts.status === 'loaded'")
        page.goto(host.url + FIRST)
        until(page, "document.querySelector('article img').naturalWidth > 0")
        page.goto(f"{host.url}lessons/1.2-two")  # as hosts that leave out the ending call it
        see(page, "Text of two.")


def test_page_that_is_not_there_leads_back_when_there_is_a_network(
    stored_page: tuple[Page, Host],
) -> None:
    page, host = stored_page
    with host.away():
        page.goto(f"{host.url}lessons/9.9-none.html?x=<b>&y")
        expect(page).to_have_url(re.compile(rf"^{re.escape(host.url)}offline/\?from="))
        expect(page.locator("h1")).to_have_text("Offline reading")
        missing = page.locator(".keep-missing")
        expect(missing).to_contain_text("/course/lessons/9.9-none.html?x=%3Cb%3E&y")
        again = missing.get_by_role("link", name="Try again")
        address = f"{host.url}lessons/9.9-none.html?x=%3Cb%3E&y"
        expect(again).to_have_attribute("href", address)
    again.click()
    expect(page).to_have_url(address)
    expect(page.locator("h1")).to_have_text("Page not found")


def test_no_way_back_leads_elsewhere(stored_page: tuple[Page, Host]) -> None:
    page, host = stored_page
    for from_ in ("https://example.com/x", "//example.com/", "/a/", "data:,"):
        page.goto(f"{host.url}offline/?from={from_}")
        page.locator(".keep input").first.wait_for()
        expect(page.locator(".keep-missing")).to_have_count(0)


def test_nothing_is_asked_for_before_the_page_has_loaded_and_only_once(
    context: BrowserContext, host: Host
) -> None:
    page, _ = watch_page(context)
    page.goto(host.url + FIRST)
    load_end = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")
    until(page, "navigator.serviceWorker.controller !== null")
    list_ = "performance.getEntriesByType('resource').filter(({ name }) => /files.json/.test(name))"
    assert page.evaluate(f"{list_}.every(({{ startTime }}) => startTime > {load_end})")
    settle(page)
    host.take_requests()
    page.goto(host.url + SECOND)
    settle(page)
    assert host.take_requests() == [SECOND]


def test_page_that_was_kept_says_when_there_is_a_newer_one(
    context: BrowserContext, host: Host, offline_course: Folder
) -> None:
    page, _ = settled_page(context, host)
    with host.away():
        visited(page, host, FIRST)  # which hears of no newer list
        build_edited(
            offline_course,
            host.folder,
            ("content/lessons/1.1-one.md", "Text of one.", "Other text."),
        )
        see(page, "Text of one.")
    page.evaluate("window.dispatchEvent(new Event('online'))")
    expect(page.locator(".notice")).to_contain_text("This page has changed")
    page.get_by_role("button", name="Load it again").click()
    see(page, "Other text.")
    expect(page.locator(".notice")).to_have_count(0)


def test_several_courses_on_one_origin(
    context: BrowserContext, offline_course: Folder, tmp_path: Path
) -> None:
    shutil.copytree(offline_course.root / "first", tmp_path / "both")
    shutil.copytree(offline_course.root / "first", tmp_path / "both" / "inner")
    with Host(tmp_path / "both") as host:
        settled_page(context, host)
        page, _ = settled_page(context, host, "inner/")
        names = page.evaluate("caches.keys()")
        assert sorted(names) == [f"coursebuild 1 {host.url}", f"coursebuild 1 {host.url}inner/"]
        page.goto(f"{host.url}inner/offline/")
        page.get_by_label("nothing", exact=True).check()
        see(page, "Nothing of the course is kept here.")
        assert page.evaluate("caches.keys()") == [f"coursebuild 1 {host.url}"]
        scopes = "navigator.serviceWorker.getRegistrations().then(all => all.map(r => r.scope))"
        assert page.evaluate(scopes) == [host.url]


def test_reader_chooses_what_is_kept(context: BrowserContext, host: Host) -> None:
    page, console = watch_page(context)
    page.goto(f"{host.url}offline/")
    see(page, "files to be kept are here.")
    expect(page.get_by_label("all text and pictures")).to_be_checked()
    expect(page.locator(".keep")).to_contain_text("MB")
    page.get_by_label("everything, with all simulations").check()
    file_list = json.loads((host.folder / "files.json").read_text())
    total = sum(len(file_list[group]["files"]) for group in ("shell", "text", "rest"))
    see(page, f"{total} of {total} files to be kept are here.")
    expect(page.locator(".keep-status")).to_have_attribute("role", "status")
    page.get_by_label("nothing", exact=True).check()
    see(page, "Nothing of the course is kept here.")
    page.clock.install()
    page.goto(host.url + FIRST)
    page.clock.run_for(10_000)  # a page's own visit would have come by then
    becomes(page, lambda: page.evaluate(NOTHING_KEPT), [0, 0])
    page.goto(f"{host.url}offline/")
    page.get_by_label("what you have read").check()
    see(page, "files to be kept are here.")
    expect(page.get_by_label("what you have read")).to_be_checked()
    assert console == []


def test_last_report_stands_where_the_store_opens_after_it(
    context: BrowserContext, host: Host
) -> None:
    page, console = watch_page(context)
    page.add_init_script(SLOW_STORE)
    page.goto(f"{host.url}offline/")
    see(page, "files to be kept are here.")
    assert console == []


def test_browser_that_lets_no_worker_keep_files_is_no_matter(
    open_address: Callable[[str], Page], host: Host
) -> None:
    page = open_address("about:blank")
    page.clock.install()
    page.goto(host.url + FIRST)
    page.clock.run_for(10_000)
    becomes(page, lambda: page.evaluate(NOTHING_KEPT), [0, 0])


def test_site_can_be_installed(stored_page: tuple[Page, Host]) -> None:
    page, host = stored_page
    page.goto(host.url)
    client = page.context.new_cdp_session(page)
    errors = client.send("Page.getInstallabilityErrors")["installabilityErrors"]
    # A context of Playwright's is a private window, in which nothing can be installed.
    assert [error["errorId"] for error in errors if error["errorId"] != "in-incognito"] == []
    reply = client.send("Page.getAppManifest")
    assert reply["errors"] == []
    assert reply["url"] == f"{host.url}manifest.webmanifest"
    manifest = json.loads(reply["data"])
    assert manifest["name"] == "Scratch" and manifest["short_name"] == "Scratch"
    for icon in manifest["icons"]:
        sides = page.evaluate(
            "src => new Promise((done) => { const i = new Image(); i.src = src;"
            " i.onload = () => done(`${i.naturalWidth}x${i.naturalHeight}`); i.onerror = done })",
            host.url + icon["src"],
        )
        assert icon["sizes"] in ("any", sides)


NOTHING_KEPT = """async () => [
  (await caches.keys()).length, (await navigator.serviceWorker.getRegistrations()).length
]"""
HAS_ENGINE = """async () => {
  const stores = await Promise.all((await caches.keys()).map((name) => caches.open(name)))
  const kept = await Promise.all(stores.map((cache) => cache.keys()))
  return kept.flat().some(({ url }) => url.endsWith('.wasm'))
}"""


def test_lab_that_was_used_runs_without_a_network(
    context: BrowserContext, tmp_path: Path, course: Site
) -> None:
    """Also where it ran before there was a worker."""
    shutil.copytree(course.public, tmp_path / "site")
    with Host(tmp_path / "site") as host:
        page, _ = watch_page(context)
        # The host has none yet: a request that is caught in the browser can hold back the next one.
        worker = (tmp_path / "site/service-worker.js").rename(tmp_path / "worker.js")
        page.goto(host.url + PAGE)
        lab(page)
        wait_for_condition(page, lambda: "service-worker.js" in host.requests)
        worker.rename(tmp_path / "site/service-worker.js")
        page.reload()
        lab(page)
        until(page, "navigator.serviceWorker.controller !== null")
        until(page, HAS_ENGINE)
        with host.away():
            page.goto(host.url + PAGE)
            lab(page)


class FolderSession(Session):
    def find(self, path: str) -> bytes | None:
        file = self.root / path
        return file.read_bytes() if file.is_file() else None


def test_preview_is_never_shown_from_what_a_site_kept_at_its_address(
    context: BrowserContext, offline_course: Folder, tmp_path: Path
) -> None:
    """The worker that the preview serves in its place sees it off."""
    shutil.copytree(offline_course.root / "first", tmp_path / "site")
    host = Host(tmp_path / "site")
    page, _ = settled_page(context, host)
    host.stop()
    session = FolderSession(Options(host.folder, 1, Store(host.folder)))
    preview = PreviewServer("127.0.0.1", int(host.url.split(":")[2].strip("/")), session)
    preview.start()
    try:
        page.goto(f"{host.url}{FIRST}?token={preview.access.token}")
        page.wait_for_url(host.url + FIRST)  # the link let the browser in
        left = "navigator.serviceWorker.getRegistrations().then(all => all.length === 0)"
        until(page, left)
        until(page, "caches.keys().then(names => names.length === 0)")
        page.clock.install()
        page.goto(host.url + SECOND)
        page.clock.run_for(10_000)
        until(page, left)  # a page of a preview registers nothing
        until(page, "navigator.serviceWorker.controller === null")
    finally:
        preview.stop()
