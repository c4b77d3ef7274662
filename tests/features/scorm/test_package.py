"""The course as a package of SCORM 1.2: its manifest, its files, and where it may be written."""

from __future__ import annotations

import posixpath
import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

import pytest
from lxml import etree

from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.references import check_links
from support.archives import Package, entries, mistakes, referenced_files, scorm_schema
from support.question_zoo import ANY, quiz
from support.scratch_course import Folder, Make

pytestmark = pytest.mark.engine

ZIP = "course-scorm.zip"
CP = "{http://www.imsproject.org/xsd/imscp_rootv1p1p2}"
KIND = "{http://www.adlnet.org/xsd/adlcp_rootv1p2}scormtype"


def package(folder: Folder) -> dict[str, bytes]:
    folder.main("export", "scorm").require_success()
    files = entries(folder.root / ZIP)
    check(files)
    return files


def check(files: dict[str, bytes]) -> None:
    manifest = files["imsmanifest.xml"]
    assert mistakes(scorm_schema(), manifest) == []
    paths = set(referenced_files(manifest))
    assert paths == set(files) - {"imsmanifest.xml"}
    root = etree.fromstring(manifest)
    resources = {node.get("identifier"): node for node in root.iter(f"{CP}resource")}
    for item in root.iter(f"{CP}item"):
        target = item.get("identifierref")
        assert (target is None) == (item.find(f"{CP}item") is not None), "a level opens nothing"
        assert target is None or resources[target].get(KIND) == "sco"
    for sco in (node for node in resources.values() if node.get(KIND) == "sco"):
        needs = [node.get("identifierref") for node in sco.iter(f"{CP}dependency")]
        assert needs == ["shared"] and resources["shared"].get(KIND) == "asset"
        assert sco[0].get("href") == sco.get("href"), "what is opened is the first of its files"
    hrefs = [node.get("href") for node in root.iter(f"{CP}file")]
    assert len(set(hrefs)) == len(hrefs), "a file in two resources"


def items(files: dict[str, bytes]) -> list[tuple[int, str]]:
    root = etree.fromstring(files["imsmanifest.xml"])
    return [
        (len(list(node.iterancestors(f"{CP}item"))), node.findtext(f"{CP}title"))
        for node in root.iter(f"{CP}item")
    ]


def test_package_has_levels_and_written_lessons(scorm: Package) -> None:
    check(scorm.files)
    assert items(scorm.files) == [(0, "1 Level"), (1, "1.1 Lesson one"), (1, "1.2 Lesson two")]
    assert "lessons/0.1-later.html" in scorm.files, "its page is there, since others link to it"
    assert {path for path in scorm.files if path.startswith("sco/")} == {
        "sco/1.1-one.html", "sco/1.2-two.html", "sco/scorm.css", "sco/scorm.js"
    }  # fmt: skip


def test_files_that_a_platform_has_no_use_for_are_left_out(scorm: Package) -> None:
    files = scorm.files
    assert scorm.folder.main("build").status == 0
    site = scorm.folder.tree("public")
    left_out = {path for path in site if path not in files} - {".coursebuild-site"}
    assert {path for path in left_out if not path.endswith((".br", ".gz"))} == {
        "404.html", "files.json", "manifest.webmanifest", "robots.txt", "service-worker.js"
    }  # fmt: skip
    common = [path for path in files if path in site]
    link = rb'<link rel="manifest" [^>]*>\n'
    changed = [path for path in common if files[path] != re.sub(link, b"", site[path])]
    assert changed == [], "pages are the site's"
    assert len(common) == len(files) - 5, "the manifest, two lessons' starts and what starts share"
    assert len([path for path in files if path.endswith(".wasm")]) == 1


def test_no_address_leads_nowhere(scorm: Package) -> None:
    files = scorm.files
    with_error_page = {**files, "404.html": b""}
    broken = list(check_links((OutputFile(p, d) for p, d in with_error_page.items()), ""))
    assert [(link.page, link.url) for link in broken] == []
    for path in (path for path in files if path.startswith("sco/") and path.endswith(".html")):
        for address in addresses(files[path].decode()):
            assert posixpath.normpath(f"sco/{unquote(address)}") in files


def addresses(html: str) -> list[str]:
    hrefs: list[str] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            hrefs.extend(value or "" for key, value in attrs if key in ("href", "src", "data-src"))

    Reader().feed(html)
    return [urlsplit(address).path for address in hrefs]


def test_package_with_hostile_titles_in_arabic_follows_edits(make_course: Make) -> None:
    folder = make_course("## One\n\nText.\n")
    long = 'دورة <b>"title"</b> & ' + "ü" * 300
    old = 'title = "Scratch"'
    folder.replace("content/course.toml", old, f"title = '{long}'\nlanguage = \"ar\"")
    folder.replace("content/course.toml", 'title = "Lesson one"', "title = '</title>&amp;<i>'")
    files = package(folder)
    root = etree.fromstring(files["imsmanifest.xml"])
    title = root.findtext(f"{CP}organizations/{CP}organization/{CP}title")
    assert title == long[:199] + "…"
    assert items(files)[1] == (1, "1.1 </title>&amp;<i>")
    page = files["sco/1.1-one.html"].decode()
    assert '<iframe title="1.1 &lt;/title&gt;&amp;amp;&lt;i&gt;"></iframe>' in page
    assert '<html lang="ar" dir="rtl"' in page
    folder.write(folder.lesson(), "## One\n\n[A log](log.csv.gz)\n\n" + quiz("a", ANY["zero"]))
    folder.write("content/lessons/log.csv.gz", b"\x1f\x8b")
    files = package(folder)
    assert b"data-quiz" in files["lessons/1.1-one.html"]
    assert b"\x1f\x8b" in files.values(), "what an author packed is not a copy for a host"


def test_names_are_of_xml_and_apart(scorm: Package) -> None:
    root = etree.fromstring(scorm.files["imsmanifest.xml"])
    names = [node.get("identifier") for node in root.iter() if node.get("identifier")]
    assert len(set(names)) == len(names) > 3
    assert all(re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", name) for name in names)


def test_launch_page_keeps_to_the_policy_of_pages(scorm: Package) -> None:
    page = scorm.files["sco/1.1-one.html"].decode()
    assert "default-src &#39;self&#39;" in page and "object-src &#39;none&#39;" in page
    assert re.findall(r"<script[^>]*>", page) == ['<script src="scorm.js" defer>']
    assert " style=" not in page and " onload=" not in page
    assert '<a href="../lessons/1.1-one.html">' in page, "without JavaScript"
