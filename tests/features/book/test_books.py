"""E-books and the course on one page; what is taken from the pages of a site."""

from __future__ import annotations

import re
import shutil
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest
from hypothesis import given

from coursebuild.core.pages.html_xml import HtmlContent, HtmlElement, parse_html, to_html, to_xml
from coursebuild.core.pages.urls import Place
from coursebuild.features.book.chapters import RewriteRules, rewrite
from coursebuild.features.book.epub import xml_id
from support.archives import epub_messages
from support.built_sites import BuiltCourses
from support.fixture_cases import check_lines, fixture_text
from support.hostile_html import PAGES
from support.scratch_course import Folder, Make


def export(folder: Folder, kind: str) -> Path:
    folder.main("export", kind, "--quiet").require_success()
    return folder.root / {"epub": "course.epub", "page": "course.html"}[kind]


HOSTILE = "<b>\\\"&amp;' \\u0007 ]](x) $x$ ‏ `"
"""A title, as TOML has it."""
WILD = fixture_text("documents/wild.md")


DOT = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000d49444154789c6360606060000000050001a5f64540"
    "0000000049454e44ae426082"
)


SOURCES = r"""
@article{key:1/a, author = {<b> & "Co"}, title = {]]> <i>x</i> \'e}, doi = {10.1000/<"'&>},
  year = 1}
@misc{other, title = {{Only} a title}, url = {https://example.org/?a="b"&c=<d>}}
"""
MAP = "content/course.toml"
SITE = 'base_url = "https://example.org/a%20b/"\n'
ENTRY = '[[level.lesson]]\nid = "1.9"\nslug = "wild"\ntitle = "Wild"\nstatus = "complete"\n\n'


def wild_chapter(book: Path) -> str:
    with zipfile.ZipFile(book) as archive:
        return archive.read("EPUB/1.9-wild.xhtml").decode()


@pytest.fixture(scope="module")
def full_course(tmp_path_factory: pytest.TempPathFactory, built_courses: BuiltCourses) -> Folder:
    """The course of every construct in Arabic, with hostile titles and a lesson of wild HTML."""
    folder = Folder(tmp_path_factory.mktemp("everything") / "course")
    root = built_courses["full"].root
    shutil.copytree(root, folder.root, symlinks=True, ignore=shutil.ignore_patterns("public"))
    folder.tmp.mkdir()
    folder.write("content/lessons/1.9-wild.md", WILD)
    folder.write("content/lessons/dot.png", DOT)
    folder.write("content/lessons/data.csv", b"1,2\n")
    folder.write("content/references.bib", SOURCES)
    folder.replace(MAP, '[[level]]\nid = "A"', ENTRY + '[[level]]\nid = "A"')
    text = re.sub(r"(?m)^(base_url|language) = .*\n", "", folder.text(MAP))
    text = re.sub(r'(?m)^(title|summary) = ".*"$', lambda m: f'{m[1]} = "{HOSTILE}"', text)
    text = text.replace("[course]\n", f'[course]\nlanguage = "ar"\n{SITE}')
    folder.write(MAP, text + '\n[security]\nhtml = "trusted"\n')
    return folder


@pytest.mark.long
@pytest.mark.site
def test_ebook_of_every_construct_and_of_wild_html_is_valid(full_course: Folder) -> None:
    book = export(full_course, "epub")
    assert book.read_bytes()[30:58] == b"mimetypeapplication/epub+zip"
    assert epub_messages(book) == []
    with zipfile.ZipFile(book) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert 'page-progression-direction="rtl"' in archive.read("EPUB/package.opf").decode()
    chapter = wild_chapter(book)
    assert 'href="1.9-wild.xhtml"' in chapter and 'href="1.1-text.xhtml"' in chapter
    assert 'href="https://example.org/a%20b/files/lessons/data.csv"' in chapter
    assert "onclick" not in chapter and "press" not in chapter
    full_course.replace(MAP, SITE, "")
    chapter = wild_chapter(export(full_course, "epub"))
    assert 'href="1.1-text.xhtml"' in chapter and "data.csv" not in chapter
    full_course.replace(MAP, "[course]\n", f"[course]\n{SITE}")


@pytest.mark.site
def test_page_of_every_construct_and_of_wild_html_is_self_contained(full_course: Folder) -> None:
    page = export(full_course, "page").read_text("utf-8")
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids)) and page.count("<h1") == 1
    assert {unquote(anchor) for anchor in re.findall(r'href="#([^"]*)"', page)} <= set(ids)
    assert not re.findall(r'(?:src|srcset|poster)="(?!data:)', page)
    assert not re.findall(r"url\((?!.?(?:data:|#))", page) and "@font-face" in page
    assert "<script" not in page and "<button" not in page and "onclick" not in page
    assert 'href="https://example.org/a%20b/files/lessons/data.csv"' in page
    assert page.index('id="_1.1--_top"') < page.index('id="_1.9--_top"')


@pytest.mark.site
@pytest.mark.slow
@pytest.mark.parametrize("name", ["unicode", "real"])
def test_ebook_of_course_is_valid(built_courses: BuiltCourses, name: str, tmp_path: Path) -> None:
    book = tmp_path / "course.epub"
    built_courses[name].main("export", "epub", "--quiet", "--out", str(book)).require_success()
    assert epub_messages(book) == []


@pytest.mark.site
def test_export_follows_edits_and_can_be_offered_by_a_link(make_course: Make) -> None:
    folder = make_course("## One\n\n![a dot](dot.png)\n\nText.\n")
    folder.write("content/lessons/dot.png", DOT)
    first = {kind: export(folder, kind).read_bytes() for kind in ("epub", "page")}
    folder.write("content/lessons/dot.png", DOT + b"more")
    assert [kind for kind in first if export(folder, kind).read_bytes() == first[kind]] == []
    folder.write("content/lessons/dot.png", DOT)
    assert {kind: export(folder, kind).read_bytes() for kind in first} == first
    assert folder.main("export", "epub", "--out", "content/files/course.epub").status == 0
    folder.write(folder.lesson(1), "[The book](../files/course.epub).\n")
    assert folder.main("build", "--quiet").status == 0
    assert folder.read("public/files/files/course.epub") == first["epub"]


PAGE = Place("lessons/1.1-one.html")


def picture(path: str) -> str:
    return f"in-book/{path}" if path.endswith(".png") else ""


def link(path: str, anchor: str) -> str:
    return f"to:{path}#{anchor}" if path.startswith("lessons/") else ""


BOOK = RewriteRules(PAGE, link, picture, xml_id)
WHOLE = RewriteRules(
    PAGE,
    link,
    picture,
    "1.1--{}".format,
    heading_shift=2,
    closed_classes=frozenset({"answer"}),
    section="1.1",
)


def xml(html: str) -> str:
    return to_xml(rewrite(parse_html(html), BOOK))


def html_for_page(html: str) -> str:
    return to_html(rewrite(parse_html(html), WHOLE))


@given(PAGES)
def test_any_html_becomes_well_formed_and_runs_nothing(html: str) -> None:
    ElementTree.fromstring(f"<body>{xml(html)}</body>".encode())
    for element in walk(parse_html(html_for_page(html))):
        assert element.name not in ("script", "button")
        assert not any(name.startswith("on") for name in element.attributes)


def walk(content: Iterable[HtmlContent]) -> Iterator[HtmlElement]:
    for child in content:
        if isinstance(child, HtmlElement):
            yield child
            yield from walk(child.children)


def test_html_is_rewritten_for_the_page_and_as_xml_for_the_book(rewriting: bool) -> None:
    def convert(html: str) -> list[str]:
        return [f"page: {html_for_page(html)}", f"book: {xml(html)}"]

    check_lines(Path(__file__).with_name("rewritten.md"), convert, rewriting=rewriting)
