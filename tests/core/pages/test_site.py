"""The whole site: its files, the same bytes each time, its addresses, nothing hostile in it."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html import unescape
from html.parser import HTMLParser
from itertools import product
from urllib.parse import unquote, urljoin, urlsplit
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model import local_file
from coursebuild.core.model.lesson_record import Provenance
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.references import check_links
from coursebuild.core.pages.urls import Place, dark_path, file_path
from support.fixture_cases import fixture_tables, fixture_text
from support.rendered_course import MAP, Make

CASES = fixture_tables("addresses")
LESSON = fixture_text("documents/site.md")

FILES = {
    "content/lessons/data.csv": b"1,2\n",
    "models/meshes/hand.obj": b"v 0 0 0\n",
    "content/img/s.svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>",
}


@pytest.fixture(scope="module")
def site(make: Make) -> dict[str, bytes]:
    files: dict[str, bytes] = make(LESSON).site(FILES)
    return files


def pages(site: dict[str, bytes]) -> dict[str, str]:
    return {path: data.decode() for path, data in site.items() if path.endswith(".html")}


def test_names_of_shared_files_are_their_content(site: dict[str, bytes]) -> None:
    for path, data in site.items():
        # Fonts and what the search loads are named after their inputs, before they are made.
        if path.startswith("assets/") and not path.startswith(("assets/search/", "assets/fonts/")):
            is_copy = path.endswith((".br", ".gz"))
            assert is_copy or path.split(".")[-2] == hashlib.sha256(data).hexdigest()[:8]


def addresses(page: str) -> list[str]:
    body = re.sub(r"<(meta|link rel=\"canonical\")[^>]*>", "", page)
    return [unescape(url) for url in re.findall(r'(?:href|src)="([^"]*)"', body)]


def test_every_address_is_relative_but_on_the_page_for_missing_ones(site: dict[str, bytes]) -> None:
    for path, page in pages(site).items():
        for url in addresses(page):
            if url.startswith(("#", "https://example.org/repo")):
                continue
            if path == "404.html":
                assert url.startswith("/course/"), (path, url)
            else:
                depth = path.count("/")
                assert not url.startswith(("/", "http")), (path, url)
                assert url.startswith("../") == (url.count("../") > 0)
                assert url.count("../") <= depth, (path, url)


def test_without_a_base_address_nothing_needs_one(make: Make) -> None:
    course = make(LESSON)
    bare = replace(course, course=replace(course.course, base_url=""))
    site = bare.site(FILES)
    assert "sitemap.xml" not in site
    assert site["robots.txt"] == b"User-agent: *\nAllow: /\n"
    for page in pages(site).values():
        assert "canonical" not in page
        assert "og:url" not in page
    assert 'href="/"' in pages(site)["404.html"]
    assert check_links([OutputFile(path, data) for path, data in site.items()]) == ()


def test_what_search_engines_read(site: dict[str, bytes]) -> None:
    page = pages(site)["lessons/0.1-falling.html"]
    assert "<title>Falling · Bodies &amp; &lt;axes&gt;</title>" in page
    assert '<meta name="description" content="A body falls.">' in page
    address = "https://example.org/course/lessons/0.1-falling.html"
    assert f'<link rel="canonical" href="{address}">' in page
    assert f'<meta property="og:url" content="{address}">' in page
    data = json.loads(page.split('<script type="application/ld+json">')[1].split("</script>")[0])
    assert data["@type"] == "LearningResource"
    assert data["timeRequired"] == "PT20M"
    assert data["isPartOf"]["name"] == "Bodies & <axes>"
    home = pages(site)["index.html"]
    course = json.loads(home.split('<script type="application/ld+json">')[1].split("</script>")[0])
    assert (course["@type"], len(course["hasPart"])) == ("Course", 2)
    robots = site["robots.txt"].decode()
    assert "Sitemap: https://example.org/course/sitemap.xml" in robots
    urls = [
        e.text for e in ElementTree.fromstring(site["sitemap.xml"]).iter() if e.tag.endswith("loc")
    ]
    assert "https://example.org/course/" in urls
    assert address in urls
    assert not any("404" in str(url) or "1.2-later" in str(url) for url in urls)
    assert 'content="noindex"' in pages(site)["lessons/1.2-later.html"]


def test_pages_keep_to_a_strict_policy(site: dict[str, bytes]) -> None:
    for path, page in pages(site).items():
        policy = page.split('http-equiv="Content-Security-Policy" content="')[1].split('"')[0]
        assert "unsafe-inline" not in policy
        assert "'unsafe-eval'" not in policy
        assert not re.search(r"<[^>]*\sstyle=", page), path
        assert not re.search(r"<[^>]*\son[a-z]+=", page), path
        assert "<style" not in page
        for attributes, content in re.findall(r"<script([^>]*)>(.*?)</script>", page, re.DOTALL):
            if content:
                assert attributes == ' type="application/ld+json"'
                digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
                assert f"'sha256-{digest}'" in unescape(policy)


HOSTILE = "\"><script>alert(1)</script><b title='x'>&amp;\x07"


class Elements(HTMLParser):
    """Counts the elements of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.names: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.append(tag)


def test_nothing_hostile_gets_through(make: Make) -> None:
    rendered = make(LESSON)
    course = rendered.course
    levels = tuple(
        replace(
            level,
            title=HOSTILE,
            summary=HOSTILE,
            lessons=tuple(
                replace(x, title=HOSTILE, summary=HOSTILE, objectives=(HOSTILE,))
                for x in level.lessons
            ),
        )
        for level in course.levels
    )
    hostile = replace(
        course,
        title=HOSTILE,
        summary=HOSTILE,
        licence=HOSTILE,
        levels=levels,
        pages=tuple(replace(page, title=HOSTILE) for page in course.pages),
    )
    runs = tuple(
        replace(run, provenance=Provenance(HOSTILE, HOSTILE, ((HOSTILE, HOSTILE),)))
        for run in rendered.results.runs
    )
    results = replace(rendered.results, engine=HOSTILE, runs=runs)
    clean = pages(rendered.site(FILES))
    for path, page in pages(replace(rendered, course=hostile, results=results).site(FILES)).items():
        assert "\x07" not in page
        assert Elements(page).names.count("script") == Elements(clean[path]).names.count("script")
        assert Elements(page).names.count("b") == Elements(clean[path]).names.count("b") == 0
        for block in re.findall(r'<script type="application/ld\+json">(.*?)</script>', page):
            assert json.loads(block)["name"] in (HOSTILE, HOSTILE.replace("\x07", "␇"))


def test_every_page_has_one_heading_one_main_and_unique_ids(site: dict[str, bytes]) -> None:
    for path, page in pages(site).items():
        assert page.count("<h1") == 1, path
        assert len(re.findall('<main [^>]*id="_main"', page)) == 1
        assert '<a class="skip" href="#_main">' in page
        assert page.startswith('<!DOCTYPE html>\n<html lang="en" data-course="')
        ids = re.findall(r'\sid="([^"]*)"', page)
        assert len(ids) == len(set(ids)), path


def test_title_and_heading_of_a_page_have_one_id_between_them(make: Make) -> None:
    for page_text, count in (("# About\n\n## About\n", 1), ("# About\n\n## More\n", 1)):
        page = pages(make("Text.", about=page_text).site())["about.html"]
        assert page.count('id="about"') == count, page_text


def test_a_docked_lab_stands_beside_its_paragraphs_in_reading_order(site: dict[str, bytes]) -> None:
    page = pages(site)["lessons/0.1-falling.html"]
    dock = page.split('<div class="dock">')[1]
    before, rest = dock.split('<div class="dock-lab">')
    lab, after = rest.split('<div class="dock-after">')
    assert '<h2 id="second-part">' in before and "Back to" not in before
    assert "Docked" in lab
    assert after.startswith("\n<p>After.</p>\n</div>")


def test_the_page_home_opens_the_home_page(make: Make) -> None:
    home = '[[page]]\nid = "home"\ntitle = "Welcome"\nfile = "content/pages/home.md"\n'
    site = make("Text.", course=MAP + home, home="Come in.").site()
    home = pages(site)["index.html"]
    assert "<p>Come in.</p>" in home and 'class="cards"' in home
    assert "home.html" not in site
    assert "Come in." in site["index.md"].decode()


def test_styles_in_elements_become_classes_of_the_sheet(make: Make) -> None:
    rendered = make('Text.\n\n<p style="color: red">x</p>\n')
    site = rendered.site(FILES)
    page = pages(site)["lessons/0.1-falling.html"]
    (name,) = re.findall(r'<p class="(s[0-9a-f]{7})">x</p>', page)
    (sheet,) = (data.decode() for path, data in site.items() if path.endswith(".css"))
    assert sheet.endswith(f".{name}{{color: red}}\n")


def linked_site(page: str, path: str = "lessons/a.html") -> tuple[OutputFile, ...]:
    return (
        OutputFile(path, page.encode()),
        OutputFile("index.html", b'<h1 id="top-level">x</h1><a name="old"></a>'),
        OutputFile("levels/1 x.html", b'<p id="\xc3\xbcber">x</p>'),
        OutputFile("assets/site.css", b""),
        OutputFile("deep/index.html", b"<p id=x>"),
    )


def test_links_that_lead_somewhere_are_not_told() -> None:
    page = """<p id=here>
    <a href="#here">1</a> <a href="../index.html#top-level">2</a> <a href="../#old">3</a>
    <a href="../levels/1%20x.html#%C3%BCber">4</a> <a href="">5</a> <a href="#top">6</a>
    <a href="https://elsewhere.org/nothing">7</a> <a href="mailto:a@b.c">8</a> <a href="tel:1">9</a>
    <a href="data:text/plain,x">10</a> <link rel=stylesheet href="../assets/site.css?v=1">
    <a href="../deep/#x">11</a>
    <img src=" ../assets/site.css " srcset="../assets/site.css 2x, a.html">
    <a href="//elsewhere.org/x">12</a> <a>13</a> <!-- <a href="gone.html"> -->
    """
    assert check_links(linked_site(page)) == ()


def test_broken_links_are_reported_with_the_nearest_target() -> None:
    page = (
        '<p id="conservation">\n<a href="#conservatoin">1</a>\n'
        '<img src="../assets/sites.css" srcset="x.png 2x">\n<a href="../../up.html">2</a>'
        '<a href="b.html#x">3</a><script src=gone.js></script><a href="http://[">4</a>'
    )
    broken_links = [
        [broken.url, broken.reason, broken.suggestion or ""]
        for broken in check_links(linked_site(page))
    ]
    assert broken_links == CASES["broken"]


def test_links_of_a_site_below_a_path_stay_below_it() -> None:
    page = (
        '<a href="/course/index.html">1</a><a href="/index.html">2</a>'
        '<a href="https://h.org/course/levels/">3</a><a href="https://h.org/other/">4</a>'
        '<a href="../../index.html">5</a>'
    )
    broken = check_links(linked_site(page), "https://h.org/course/")
    assert [(b.url, b.reason) for b in broken] == [
        ("../../index.html", "the address leads out of the site"),
        ("/index.html", "the address leads out of the site"),
        ("https://h.org/course/levels/", "no file `levels/index.html` in the site"),
    ]


PATHS = CASES["paths"]


def test_the_home_page_shows_paths_and_then_what_is_in_none(make: Make) -> None:
    path = '[[path]]\ntitle = "A weekend"\nsummary = "Ends in an *arm*."\nlessons = ["0.1"]\n'
    home = pages(make("Text.", course=MAP + path).site())["index.html"]
    groups = re.findall(r'<h2 id="_written-\d">(.*?)</h2>(.*?)</section>', home, re.DOTALL)
    names = [(title, re.findall(r'data-lesson="([^"]+)"', cards)) for title, cards in groups]
    assert names == [("A weekend", ["0.1"]), ("More lessons", ["1.1"])]
    assert "<p>Ends in an *arm*.</p>" in home


def test_a_lesson_leads_on_along_its_path_where_the_map_goes_elsewhere(make: Make) -> None:
    paths = "".join(
        f'[[path]]\ntitle = "{title}"\nlessons = {ids}\n'
        for title, ids in (("As the map", ["0.1", "1.1"]), ("Back & forth", ["1.1", "0.1"]))
    )
    site = pages(make("Text.", course=MAP + paths).site())
    lessons = {name[8:11]: name for name in site if name.startswith("lessons/")}
    steps = {
        id: re.findall(r'class="pager-next".*?href="([^"]+)".*?way">(.*?)</span>', site[name])
        for id, name in lessons.items()
    }
    assert steps == {
        "0.1": [(lessons["1.1"][8:], "Next")],
        "1.1": [(lessons["0.1"][8:], "Next in “Back &amp; forth”")],
        "1.2": [],  # planned, and in no path
    }


BASES = ("https://h/", "https://h/deep/er/", "file:///home/u/site/")


def test_files_of_a_course_lie_apart_but_for_those_that_a_model_includes() -> None:
    assert file_path("content/lessons/sketch.svg") == "files/lessons/sketch.svg"
    assert dark_path("content/lessons/sketch.svg") == "files/lessons/sketch.dark.svg"
    assert file_path("models/meshes/hand.obj") == "models/meshes/hand.obj"


def test_a_browser_resolves_an_address_to_its_path() -> None:
    for start, end in product(PATHS, PATHS):
        href = Place(start).href(end, "x y")
        assert not href.startswith("/") and "//" not in href, (start, end)
        for base in BASES:
            page = base + (start if start == "index.html" else Place("index.html").href(start))
            address = urlsplit(urljoin(page, href))
            expected = (urlsplit(base).path + end, "x%20y")
            assert (unquote(address.path), address.fragment) == expected, (base, start, end)


def test_addresses_are_as_short_as_they_can_be() -> None:
    """Those of the page for missing ones start at the root."""
    for page, root, path, anchor, href in CASES["hrefs"]:
        assert Place(page, root or None).href(path, anchor) == href


def test_files_are_named_from_the_document() -> None:
    for url, path in CASES["files"]:
        assert local_file(url, "content/lessons/4.2-x.md") == path


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="/"), min_size=1))
def test_the_address_of_any_file_name_leads_to_it(name: str) -> None:
    path = f"files/{name}"
    href = Place("lessons/1-a.html").href(path)
    if name not in (".", ".."):
        assert unquote(urlsplit(urljoin("https://h/lessons/1-a.html", href)).path) == f"/{path}"


PLANNED_BETWEEN = MAP.replace(
    '[[level.lesson]]\nid = "1.1"',
    '[[level.lesson]]\nid = "1.0"\nslug = "between"\ntitle = "Between"\nstatus = "planned"\n\n'
    '[[level.lesson]]\nid = "1.1"',
)


def steps_of(page: str) -> dict[str, str]:
    """The links that lead to the pages before and after a page, by their relation."""
    pager = page[page.index('<nav class="pager"') :]
    return {
        relation: unquote(href)
        for relation, href in re.findall(r'rel="(prev|next)" href="([^"]+)"', pager)
    }


def test_previous_and_next_pass_over_planned_lessons(make: Make) -> None:
    site = pages(make("Text.", course=PLANNED_BETWEEN).site())
    assert steps_of(site["lessons/0.1-falling.html"]) == {"next": "1.1-spinning.html"}
    assert steps_of(site["lessons/1.1-spinning.html"]) == {"prev": "0.1-falling.html"}
    assert steps_of(site["lessons/1.0-between.html"]) == {
        "prev": "0.1-falling.html",
        "next": "1.1-spinning.html",
    }


def manual_map() -> str:
    """A map of pages alone, in two sections."""
    head = MAP[: MAP.index("[[page]]")]
    return head + "".join(
        f'[[page]]\nid = "{id}"\ntitle = "{id.title()}"\nfile = "{id}.md"\nsection = "{section}"\n'
        for id, section in (("about", "Begin"), ("second", "Begin"), ("third", "Reference"))
    )


def test_pages_in_sections_make_a_manual(make: Make) -> None:
    files = make("", course=manual_map(), second="Two.", third="Three.").site()
    site = pages(files)
    assert steps_of(site["second.html"]) == {"prev": "about.html", "next": "third.html"}
    (page_list,) = re.findall(r'<nav class="level-nav".*?</nav>', site["second.html"], re.DOTALL)
    assert re.findall(r'<p class="label">(.*?)</p>', page_list) == ["Begin", "Reference"]
    assert re.findall(r'<a href="(\w+).html"(?: aria-current="page")?>', page_list) == [
        "about",
        "second",
        "third",
    ]
    assert "Course map" not in site["second.html"] + site["index.html"]
    assert "progress/index.html" not in site
    assert b"## Reference" in files["llms.txt"]
