"""The glossary, the indexes of symbols and of the search, and drawings, in built sites."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder, Make

pytestmark = pytest.mark.site
HEAD = '[course]\ntitle = "<b>Course</b>"\n\n[[level]]\nid = "1"\ntitle = "One"\n'

FIRST = fixture_text("documents/symbols_first.md")
SECOND = fixture_text("documents/lookup_second.md")
THIRD = fixture_text("documents/symbols_third.md")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> dict[str, str]:
    folder = Folder(tmp_path_factory.mktemp("lookup") / "course")
    folder.fill([FIRST, SECOND, THIRD], stores)
    folder.main("build").require_success()
    return {
        path: data.decode()
        for path, data in folder.tree("public").items()
        if path.endswith(".html") or path.startswith("assets/search/")
    }


def entries(page: str) -> dict[str, str]:
    """The entries of a glossary, by the id of the term."""
    parts = re.split(r'<div class="term" id="term:(.*?)">(.*?)</div>', page, flags=re.DOTALL)
    return dict(zip(map(unescape, parts[1::3]), parts[2::3], strict=True))


def text(html: str) -> str:
    visible = re.sub(r"<(annotation)\b.*?</\1>", "", html, flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]*>", "", visible)).split())


def test_the_terms_are_in_order_whatever_their_script(site: dict[str, str]) -> None:
    terms = list(entries(site["glossary/index.html"]))
    signs = ["3-vector", "scriptalert1script"]
    latin = ["äther", "inertia-tensor", "item", "principal-axis", "ⱥ"]
    assert terms == [*signs, *latin, "عزم-القصور", "慣性"]
    letters = re.findall(r'<h2 id="letter:(.*?)">(.*?)</h2>', site["glossary/index.html"])
    assert [letter for _, letter in letters] == ["0–9", "A", "I", "P", "Ⱥ", "ع", "慣"]
    assert len({id for id, _ in letters}) == len(letters)


def test_an_entry_is_two_sentences_or_one_and_the_formula_that_it_leads_to(
    site: dict[str, str],
) -> None:
    terms = entries(site["glossary/index.html"])
    tensor = terms["inertia-tensor"]
    assert text(tensor).startswith("inertia tensor For a body of volume V, the inertia tensor is I")
    assert '<math display="block"' in tensor
    assert text(terms["item"]).startswith(
        "item An item in a list, 1 < 2, of Table 1.1.1 and (1) of Lesson 1.1. Defined in 1.1 Lesson"
    )
    axis = terms["principal-axis"]
    assert text(axis).startswith(
        "Principal axis A principal axes is x & <b>, see. Last. Defined in"
    )
    assert "<em>axes</em>" in axis and "<code>&lt;b&gt;</code>" in axis
    assert 'href="../lessons/1.2-two.html"' not in axis, "links stay behind"


def test_an_entry_says_where_the_term_is_defined_and_used(site: dict[str, str]) -> None:
    terms = entries(site["glossary/index.html"])
    first, second, third = (site[f"lessons/1.{n}.html"] for n in ("1-one", "2-two", "3-three"))
    assert '<dfn id="term:inertia-tensor">inertia tensor</dfn>' in first
    assert '<a href="#term%3Ainertia-tensor">it</a>' in first
    assert '<a href="1.1-one.html#term%3Ainertia-tensor">tensor</a>' in second
    assert '<dfn id="term:عزم-القصور">' in third
    assert '<a href="../lessons/1.1-one.html#term%3Ainertia-tensor">' in terms["inertia-tensor"]
    assert text(terms["inertia-tensor"]).endswith("Used in 1.2")
    assert text(terms["principal-axis"]).endswith("Used in 1.3")
    assert "Used in" not in terms["item"]
    assert text(terms["äther"]).endswith("Used in 1.3")  # however its letters are composed


def test_nothing_hostile_is_markup(site: dict[str, str]) -> None:
    for page in (page for path, page in site.items() if path.endswith(".html")):
        assert "<script>alert" not in page
        assert "<i>" not in page
    assert "&lt;script&gt;alert(1)" in site["glossary/index.html"]
    assert "rate &lt;i&gt;" in site["symbols/index.html"]


def test_an_identity_says_that_it_is_not_proven_and_where_it_was_tried(
    site: dict[str, str],
) -> None:
    page = site["lessons/1.3-three.html"]
    first, second = re.findall(r'<small class="equation-check">(.*?)</small>', page)
    assert first == "Not proven; tried at 32 points"
    assert text(second) == "Not proven; tried at 32 points (w≥0)"


def test_formulas_have_ids_numbers_and_references(site: dict[str, str]) -> None:
    first, second = site["lessons/1.1-one.html"], site["lessons/1.2-two.html"]
    ids = re.findall(r'<span class="equation" id="(.*?)">', first)
    assert (*ids[:2], ids[3]) == ("eq:tensor", "eq:rate", "eq:a")
    numbers = re.findall(r'<span class="(?:equation-number|tml-eqn)">(.*?)</span>', first)
    assert numbers == ["(1)", "(2)", "(3)", "(4)"]
    assert '<a href="#eq%3Atensor">(1)</a>' in first or '<a href="#eq:tensor">(1)</a>' in first
    assert '<a href="1.1-one.html#eq%3Atensor">(1) of Lesson 1.1</a>' in second
    assert '<a href="1.1-one.html#eq%3Arate">(*) of Lesson 1.1</a>' in second
    assert '<a href="1.1-one.html#eq%3Arate">rate</a>' in second


def test_tables_and_listings_have_numbers_of_their_lesson(site: dict[str, str]) -> None:
    first, second = site["lessons/1.1-one.html"], site["lessons/1.2-two.html"]
    caption = '<span class="numbered">Table 1.1.1</span> Sizes &amp; <em>names</em>.'
    assert f'<figure class="captioned" id="tab:sizes">\n<figcaption>{caption}</figcaption>' in first
    assert '<span class="numbered">Listing 1.1.1</span></figcaption>' in first
    assert (
        'By <a href="#lst:run">Listing 1.1.1</a> and <a href="#tab:sizes">Table 1.1.1</a>' in first
    )
    assert '<a href="1.1-one.html#tab%3Asizes">Table 1.1.1</a>' in second


def test_links_without_a_text_are_named_in_contents_and_search(site: dict[str, str]) -> None:
    contents = site["lessons/1.1-one.html"].partition('class="toc')[2].partition("</nav>")[0]
    assert "Detail of Table 1.1.1" in text(contents)
    search = "".join(data for path, data in site.items() if path.startswith("assets/search/"))
    assert "By Listing 1.1.1 and Table 1.1.1." in search
    assert "the (1) of Lesson 1.1, the (*) of Lesson 1.1" in search


def test_the_index_of_symbols(site: dict[str, str]) -> None:
    page = site["symbols/index.html"]
    declared_part, _, undeclared_part = page.partition('<section class="undeclared"')
    rows = [text(row) for row in declared_part.split("<tbody>")[1:]]
    assert rows == [
        "q˙ rate <i> 1/s 1.1 Law",
        "V volume (1.1) m³ 1.1 Core, also in 1.2 voltage (1.2)",
        "w width 1.1 Detail of Table 1.1.1, also in 1.3",
    ]
    symbols = [text(item) for item in undeclared_part.partition("</section>")[0].split("<li>")[1:]]
    assert [item.split()[0] for item in symbols] == ["a", "I", "x", "z", "ρ"]


def test_the_foot_has_both(site: dict[str, str]) -> None:
    foot = site["glossary/index.html"].partition('class="site-more"')[2]
    assert '<a href="index.html" aria-current="page">Glossary</a>' in foot
    assert '<a href="../symbols/index.html">Symbols</a>' in foot


def test_the_search_lists_lessons_in_the_order_of_the_course(make: Make) -> None:
    folder = make("## Swing\n\nA.\n", "## Fall\n\nB.\n", "## Spin\n\nC.\n")
    assert folder.main("build", "--quiet").status == 0
    listing = folder.text("public/search/index.js").partition(',"",')[2].rstrip()
    pages = json.loads(listing[:-1])["pages"]
    assert [id for _, _, _, id, *_ in pages if id] == ["1.1", "1.2", "1.3"]


# --- drawings


def mapped(folder: Folder, lessons: dict[str, list[str]], titles: dict[str, str]) -> None:
    parts = [HEAD]
    for number, (id, needs) in enumerate(lessons.items()):
        title = titles.get(id, f"Title {id}").replace("\\", "\\\\").replace('"', '\\"')
        if number == 40:
            parts.append('[[level]]\nid = "2"\ntitle = "Two"\n')
        parts.append(
            f'[[level.lesson]]\nid = "{id}"\nslug = "l{number}"\ntitle = "{title}"\n'
            f"prerequisites = {needs!r}\nstatus = ".replace("'", '"')
            + ('"complete"\n' if id == "1.1" else '"planned"\n')
        )
    folder.write("content/course.toml", "\n".join(parts))
    (folder.root / folder.lesson()).unlink()
    folder.write("content/lessons/1.1-l0.md", "Text.")


def drawing(page: str, kind: str) -> str:
    return page.partition(f'<svg class="graph-{kind}"')[2].partition("</svg>")[0]


def test_a_lesson_shows_what_it_needs_and_leads_to(make: Make) -> None:
    folder = make("Text.")
    lessons = {
        "1.1": [],
        "1.2": ["1.1"],
        "1.3": ["1.1", "1.2"],
        "1.4": ["1.3"],
        "1.5": ["1.3", "1.1"],
    }
    mapped(folder, lessons, {"1.2": '<img src=x onerror="alert(1)"> & عنوان', "1.4": "x" * 300})
    folder.main("build").require_success()
    picture = drawing(folder.text("public/lessons/1.1-l0.html"), "wide")
    assert re.findall(r'class="node-id"[^>]*>(.*?)<', picture) == ["1.1", "1.2", "1.3", "1.5"]
    heads = re.search(r'class="heads" d="(.*?)"', picture)
    # The path along 1.2 and 1.3 implies that 1.3 and 1.5 need it.
    assert heads is not None and heads[1].count("M") == 3
    level = folder.text("public/levels/1.html")
    assert "<img" not in level
    assert "&lt;img src=x" in drawing(level, "wide")
    assert "x" * 300 not in re.sub('aria-label="[^"]*"', "", drawing(level, "wide"))
    for kind in ("wide", "narrow"):
        assert drawing(level, kind).count("<a ") == 5


def test_large_levels_and_lessons_with_many_heirs_stay_small(make: Make) -> None:
    folder = make("Text.")
    many = {f"1.{n}": ["1.1"] if n > 1 else [] for n in range(1, 41)}
    many |= {f"2.{n}": ["1.1", f"1.{n % 39 + 2}"] for n in range(1, 61)}
    mapped(folder, many, {})
    folder.main("build").require_success()
    html = folder.text("public/lessons/1.1-l0.html")
    assert drawing(html, "wide").count('class="node-id"') == 6
    assert 'class="graph-' in folder.text("public/levels/1.html")
    assert 'class="graph-' not in folder.text("public/levels/2.html"), "it has sixty lessons"
