"""A lesson as slides: where they begin, what is on them, and that one file is enough."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from urllib.parse import unquote

import pytest

from coursebuild.core.pages.html_xml import HtmlElement, parse_html
from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, Folder, Make

pytestmark = pytest.mark.site
MAP = "content/course.toml"


def slides(folder: Folder, lesson: str = "1.1") -> str:
    folder.main("export", "slides", lesson, "--quiet").require_success()
    return folder.text(f"{lesson}-slides.html")


def texts(page: str) -> list[tuple[str, str, str]]:
    body = HtmlElement("body", {}, parse_html(page))
    parts = []
    for slide in body.nearest("section"):
        section = next((p.text for p in slide.elements if "slide-section" in p.classes), "")
        heading = next((h.text.strip() for h in slide.nearest("h1", "h2", "h3")), "")
        parts.append((section, heading, " ".join(slide.text.split())))
    return parts


LESSON = fixture_text("documents/slides.md")


def test_a_slide_begins_at_each_heading_of_the_second_and_third_level(make_course: Make) -> None:
    parts = texts(slides(make_course(LESSON)))
    assert [(section, heading) for section, heading, _ in parts] == [
        ("Scratch", "1.1 Lesson one"),
        ("", ""),
        ("", "First part"),
        ("First part", "Detail"),
        ("", "Second"),
        ("Second", "At once"),
        ("", ""),
    ]
    assert "Before any heading." in parts[1][2]
    assert "Not a slide Three." in parts[3][2]
    assert "The note." in parts[6][2]


def test_code_and_what_authors_fold_is_folded_and_outputs_are_not(make_course: Make) -> None:
    page = slides(make_course(GOOD + "\n" + LESSON.replace("Before any heading.\n\n", "")))
    assert '<details class="callout callout-derivation">' in page
    [script] = re.findall(r'<figure class="script".*?</figure>', page, re.DOTALL)
    code, output = (
        script.index('<details class="fold"><summary>Code</summary>'),
        script.index('<div class="output"'),
    )
    assert code < script.index("print(") < script.index("</details>") < output


HOSTILE = fixture_text("documents/hostile_slides.md")


def test_one_file_is_enough_and_wild_html_does_nothing_in_it(make_course: Make) -> None:
    folder = make_course(HOSTILE, "## Two\n\nText.\n")
    title = "<b>\\\"&amp;' </script>"
    folder.replace(MAP, 'title = "Lesson one"', f'title = "{title}"')
    folder.write(MAP, folder.text(MAP) + '\n[security]\nhtml = "trusted"\n')
    page = slides(folder)
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids)) and "__slide-1" in ids
    anchors = {unquote(anchor) for anchor in re.findall(r'href="#([^"]*)"', page)}
    assert anchors and anchors <= set(ids)
    head, _, rest = page.partition('<script type="module">')
    script, _, rest = rest.partition("</script>")
    text = head + rest
    assert not re.findall(r'(?:src|srcset|poster)="(?!data:)', text)
    assert "onclick" not in text and "data-config" not in text and "<iframe" not in text
    assert "<script" not in text and "<b>" not in text.replace("<b>b</b>", "")
    assert 'href="https://example.org/x"' in text and "1.2-two" not in text
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy is not None and f"sha256-{digest}" in policy[1].replace("&#39;", "'")
    assert "default-src" in policy[1] and "unsafe-eval" not in policy[1]


LAB = fixture_text("documents/slides_lab.md")


def test_what_a_lab_loads_is_in_the_file(make_course: Make) -> None:
    page = slides(make_course(LAB))
    packed = re.findall(
        r'<script type="text/plain" data-file="([^"]*)"[^>]*>([^<]*)</script>', page
    )
    files = {path: gzip.decompress(base64.b64decode(text)) for path, text in packed}
    [lab] = re.findall(r'data-config="([^"]*)" data-script="([^"]*)"', page)
    assert json.loads(files[lab[0]])["title"] == "Square"
    assert b"mountLab" in files[lab[1]]
    assert "unsafe-eval" not in page.partition("<title>")[0], "only the engine needs it"


def test_right_to_left_courses_have_their_words_and_their_direction(make_course: Make) -> None:
    folder = make_course("## نص\n\nنص.\n")
    folder.replace(MAP, "[course]\n", '[course]\nlanguage = "ar"\n')
    page = slides(folder)
    assert '<html lang="ar" dir="rtl"' in page
    assert 'aria-label="الشريحة 2 من 2"' in page and ">الشريحة التالية</span>" in page


def test_which_lesson_must_be_named_and_written(make_course: Make) -> None:
    folder = make_course("## One\n\nText.\n")
    for arguments, message in (
        (("slides",), "`export slides` writes one lesson, but none was named"),
        (("slides", "1.7"), "no lesson or page is called `1.7`"),
        (("page", "1.1"), "`export page` writes the whole course, and takes no lesson"),
    ):
        result = folder.main("export", *arguments)
        assert (result.status, message in result.err) == (2, True), result.err
    first = slides(folder)
    assert slides(folder) == first, "an earlier export is replaced, by the same"
