"""Citations and references on pages, in their copies, in other languages and styles."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from coursebuild.core.text.source import Source
from coursebuild.features.references.bibtex import read_works
from coursebuild.features.references.csl import StyleFailure, format_works
from support.fixture_cases import fixture_text
from support.scratch_course import Folder

LIST = fixture_text("documents/references.bib")
NUMERIC = fixture_text("documents/numeric.csl")
FIRST = fixture_text("documents/cited.md")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> dict[str, str]:
    folder = Folder(tmp_path_factory.mktemp("references") / "course")
    folder.fill([FIRST, "## Two\n\nBy [@one] and [@team].\n"], stores)
    folder.write("content/references.bib", LIST)
    folder.main("build").require_success()
    return {
        path: data.decode()
        for path, data in folder.tree("public").items()
        if path.endswith((".html", ".md", ".ipynb"))
    }


def test_citations_lead_to_the_references_of_their_lesson_and_back(site: dict[str, str]) -> None:
    page = site["lessons/1.1-one.html"]
    citations = re.findall(r'<span class="citation">(.*?)</span>', page)
    assert citations[0] == (
        '(<a href="#ref:euler1758" id="cite:euler1758" role="doc-biblioref">Euler 1765, p. 12</a>)'
    )
    texts = [re.sub("<.*?>", "", citation) for citation in citations]
    assert texts[1:] == [
        "(as one may see in Goldstein, Poole and Safko 2002, chap. 3; van der Berg 2001a)",
        "(Euler 1765)",
        "(van der Berg 2001b)",
    ]
    references = page[page.index('role="doc-bibliography"') :]
    assert re.findall(r'<li id="(.*?)">', references)[:4] == [
        *("ref:euler1758", "ref:goldstein", "ref:one", "ref:two")
    ]
    assert '<a href="#cite%3Aeuler1758" class="footnote-back"' in references
    assert '<a class="url" href="https://doi.org/10.1000/1_2">doi:10.1000/1_2</a>.' in references
    assert "<i>Mémoires</i> 14, pp. 154–193." in references
    assert "me@example.org" in page


def test_what_a_list_of_sources_says_is_text(site: dict[str, str]) -> None:
    for page in site.values():
        assert not re.search(r"(?<!\\)<script>alert", page)  # Markdown has a backslash before it
    assert "&lt;script&gt;alert(1)" in site["references/index.html"]


def test_the_page_of_references_lists_all_with_the_lessons_that_cite_them(
    site: dict[str, str],
) -> None:
    page = site["references/index.html"]
    rows = re.findall(r'<li id="ref:(.*?)">.*?Cited in (.*?)</span></li>', page)
    lessons = {key: re.findall(r'href="(.*?)"', links) for key, links in rows}
    assert lessons["one"] == [
        *("../lessons/1.1-one.html#cite%3Aone", "../lessons/1.2-two.html#cite%3Aone")
    ]
    assert lessons["team"] == ["../lessons/1.2-two.html#cite%3Ateam"]


def test_copies_have_citations_and_references(site: dict[str, str]) -> None:
    copy = site["lessons/1.1-one.md"]
    assert "([Euler 1765, p. 12](#ref:euler1758))" in copy
    assert "**References**\n\n- " in copy
    assert "*Classical Mechanics*. 3rd ed. ISBN 978-0-201-65702-9." in copy
    assert "Classical Mechanics" in site["lessons/1.1-one.ipynb"]


SOURCE = Source("content/references.bib", LIST)


@pytest.mark.parametrize(
    ("language", "locator", "conjunction"),
    [("de", "S. 12", "und"), ("fr", "p. 12", "et"), ("es", "p. 12", "y"), ("ar", "ص 12", "و")],
)
def test_a_reference_is_in_the_language_of_the_course(
    language: str, locator: str, conjunction: str
) -> None:
    works = format_works(SOURCE, None, language, ("goldstein",))
    assert (
        works.mark("goldstein", "p. 12") == f"Goldstein, Poole {conjunction} Safko 2002, {locator}"
    )
    assert f"Charles P. Poole {conjunction} John Safko" in works.entries["goldstein"]


@pytest.mark.parametrize(
    ("call", "last_call", "reason"),
    [
        ('<text macro="m{}"/>', 'macro="m0"', "recursion"),
        ('<text macro="m{0}"/><text macro="m{0}"/>', 'variable="title"', "more than 10,000 times"),
    ],
)
def test_a_style_that_would_take_forever_is_refused(call: str, last_call: str, reason: str) -> None:
    macros = [f'<macro name="m{n}">{call.format(n + 1)}</macro>' for n in range(60)]
    macros.append(f'<macro name="m60"><text {last_call}/></macro>')
    style = NUMERIC.replace('variable="title"', 'macro="m0"')
    style = style.replace("<citation>", f"{''.join(macros)}<citation>", 1)
    with pytest.raises(StyleFailure, match=reason):
        format_works(SOURCE, Source("content/references.csl", style), "en", ("goldstein",))


def test_a_course_may_have_a_style_of_its_own() -> None:
    style = Source("content/references.csl", NUMERIC)
    works = format_works(SOURCE, style, "en", ("goldstein", "euler1758"))
    assert (works.prefix, works.mark("euler1758", "p. 12"), works.suffix) == ("[", "2", "]")
    assert works.entries["goldstein"] == "Classical Mechanics"


def test_names_of_bodies_stay_whole() -> None:
    works = {work.key: work for work in read_works(SOURCE).value}
    assert works["team"].people[0][1][0].family == "The MuJoCo Team"
    assert works["one"].people[0][1][0].particle == "van der"
