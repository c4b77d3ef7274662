"""Manuals of several versions beside each other: the list in the head, the note on older ones."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from support.fixture_cases import fixture_text
from support.scratch_course import ROOT, Folder
from support.static_host import Host

pytestmark = pytest.mark.browser

MAP = fixture_text("documents/versions.toml")


@pytest.fixture(scope="module")
def docs(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[str]:
    """The address of the manuals 0.9.0 and 0.10.0, each with a page that the other one lacks."""
    top = tmp_path_factory.mktemp("versions")
    for version, page in (("0.9.0", "before"), ("0.10.0", "after")):
        folder = Folder(top / page)
        folder.write("content/course.toml", MAP.format(version=version, page=page))
        for name, title in (("home", "A manual"), ("page", "A page"), ("rules", "Rules")):
            folder.write(f"{name}.md", f"# {title}\n\nWords.\n")
        folder.borrow(stores)
        folder.main("build", "--strict").require_success()
        site = top / f"site-{page}"
        site.mkdir()
        (folder.root / "public").rename(site / "docs")
        arguments = [ROOT / "docs/release.py", "manuals", site, top / "files", top / "files"]
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    with Host(top / "site-after") as host:
        yield f"{host.url}docs/"


def test_an_older_version_says_so_and_leads_to_the_same_page_of_the_newest(
    open_address: Callable[[str], Page], docs: str
) -> None:
    page = open_address(f"{docs}0.9.0/rules.html")
    note = page.get_by_text("These pages are of an older version.")
    expect(note).to_be_visible()
    note.get_by_role("link", name="To the newest version").click()
    page.wait_for_url(f"{docs}rules.html")
    expect(page.get_by_text("Version 0.10.0")).to_be_visible()
    expect(page.locator(".older-version")).to_have_count(0)


def test_the_list_leads_from_page_to_page_and_home_where_there_is_none(
    open_address: Callable[[str], Page], docs: str
) -> None:
    page = open_address(f"{docs}rules.html")
    page.get_by_text("Version 0.10.0").click()
    entries = page.locator(".versions a")
    expect(entries).to_have_text(["0.10.0", "0.9.0"])
    expect(entries.first).to_have_attribute("aria-current", "true")
    expect(entries.last).to_have_attribute("href", f"{docs}0.9.0/rules.html")
    page.goto(f"{docs}after.html")
    page.get_by_text("Version 0.10.0").click()
    entries.last.click()
    page.wait_for_url(f"{docs}0.9.0/")
    expect(page.locator(".older-version")).to_be_visible()


def test_the_folder_of_the_newest_version_is_not_an_older_one(
    open_address: Callable[[str], Page], docs: str
) -> None:
    page = open_address(f"{docs}0.10.0/")
    page.get_by_text("Version 0.10.0").click()
    expect(page.locator(".versions a").last).to_have_attribute("href", f"{docs}0.9.0/")
    expect(page.locator(".older-version")).to_have_count(0)


def test_the_list_fits_on_a_phone(open_address: Callable[[str], Page], docs: str) -> None:
    page = open_address(f"{docs}0.9.0/rules.html")
    page.set_viewport_size({"width": 360, "height": 700})
    page.get_by_text("Menu").click()
    page.get_by_text("Version 0.9.0").click()
    expect(page.locator(".versions a").first).to_be_visible()
    expect(page.locator(".versions a").first).to_be_in_viewport()
