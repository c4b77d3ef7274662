"""The index of the search, and what pages and their parts add to it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.context import NotedPage, PageInputs, SiteContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import page_list
from coursebuild.features.search.index_files import LIST, IndexPlan, search_files
from coursebuild.features.search.page import (
    Section,
    SectionPiece,
    SectionReader,
    note_page,
    page_sections,
    text_and_terms,
    weigh_terms,
)
from coursebuild.features.search.words import (
    count_terms,
    is_fuzzy,
    plain_formula,
    shelf_of,
    terms_of,
)
from support.fixture_cases import check_lines, fixture_text
from support.rendered_course import Make
from support.search_shards import read_shard


@pytest.fixture(scope="module")
def library(make: Make) -> Library:
    rendered_course = make("Text.")
    return rendered_course.library()


class Cache(dict[str, bytes]):
    def get_or_make(self, key: str, make: Callable[[], bytes]) -> bytes:
        if key not in self:
            self[key] = make()
        return self[key]


def course(pages: int, words: int = 40) -> dict[str, dict[str, int]]:
    """Terms with their weight, by page; some are common, some rare."""
    return {
        f"lessons/{n}.html": {
            f"term{'abcdefghij'[k % 10]}{n * k % 97}": (n + k) % 16 for k in range(words)
        }
        for n in range(pages)
    }


def search_site(
    library: Library,
    terms: dict[str, dict[str, int]],
    cache: Cache | None = None,
    kind: str = "lesson",
) -> dict[str, CachedFile]:
    notes = {
        path: f'"text of {path}"'.encode() + b"\0" + lines(weights)
        for path, weights in terms.items()
    }
    pages = tuple(
        NotedPage(path, kind, path[8:-5], f"Title {path}", hashlib.sha256(note).hexdigest())
        for path, note in notes.items()
    )
    cache = Cache() if cache is None else cache
    keep = cache.get_or_make
    site = SiteContext(library, None, None, pages, notes.__getitem__, keep, {}, None)  # type: ignore[arg-type]
    return {file.path: file for file in search_files(site)}


def lines(terms: dict[str, int]) -> bytes:
    return "\n".join(f"{weight:x}{term}" for term, weight in sorted(terms.items())).encode()


def decode_shard(data: bytes) -> dict[str, list[tuple[int, int]]]:
    return read_shard(json.loads(data.decode().partition(",")[2].partition(",")[2].rstrip()[:-1]))


def shards(files: dict[str, CachedFile]) -> dict[int, dict[str, list[tuple[int, int]]]]:
    return {
        int(path.split("/")[-1].split(".")[0], 16): decode_shard(file.make())
        for path, file in files.items()
        if path.count(".") == 2 and path.startswith("assets/search/")
    }


@pytest.mark.parametrize("pages", [1, 3, 40, 150])
def test_every_term_is_in_the_one_shard_that_the_browser_loads(
    library: Library, pages: int
) -> None:
    terms = course(pages)
    plan = IndexPlan.of(pages)
    terms_by_shard = shards(search_site(library, terms))
    assert sorted(terms_by_shard) == list(range(plan.terms + plan.words))
    expected: dict[str, list[tuple[int, int]]] = {}
    for number, weights in enumerate(terms.values()):
        for term, weight in weights.items():
            expected.setdefault(term, []).append((number, weight))
    pages_by_term: dict[str, list[tuple[int, int]]] = {}
    for shard in range(plan.terms):
        for term, term_pages in terms_by_shard[shard].items():
            assert plan.places(term)[0] == shard
            assert term not in pages_by_term
            pages_by_term[term] = term_pages
    assert pages_by_term == expected
    words = {term for n in range(plan.terms, plan.terms + plan.words) for term in terms_by_shard[n]}
    assert words == {term for term in expected if is_fuzzy(term)}


def test_an_edit_sorts_few_pages_and_makes_few_shards(library: Library) -> None:
    terms, cache = course(400), Cache()
    before = search_site(library, terms, cache)
    old_size = len(cache)
    terms["lessons/7.html"]["brandnew"] = 4
    after = search_site(library, terms, cache)
    assert len(cache) == old_size + 1
    assert len(after.keys() - before.keys()) == 3, "the term's shard, that of spellings, the text"
    changed_paths = {p for p, f in after.items() if p in before and before[p].key != f.key}
    assert changed_paths == {"search/index.js"}
    clean = search_site(library, terms)
    assert {p: (f.key, f.make()) for p, f in after.items()} == {
        p: (f.key, f.make()) for p, f in clean.items()
    }


@settings(max_examples=40)
@given(
    st.dictionaries(
        st.text(alphabet="ab", min_size=1, max_size=3).map("p/{}.html".format),
        st.dictionaries(
            st.text(alphabet="xyzé慣1_.", min_size=1, max_size=4), st.integers(0, 15), max_size=6
        ),
        max_size=40,
    )
)
def test_the_files_follow_from_the_pages_alone(
    library: Library, terms: dict[str, dict[str, int]]
) -> None:
    files = search_site(library, terms)
    first = {path: (file.key, file.make()) for path, file in files.items()}
    assert first == {path: (f.key, f.make()) for path, f in search_site(library, terms).items()}
    count = sum(len(pages) for shard in shards(files).values() for pages in shard.values())
    assert count == sum(map(len, terms.values()))


def test_the_list_of_pages_says_where_everything_is(library: Library) -> None:
    files = search_site(library, course(5))
    text = files[LIST].make().decode()
    assert text.startswith('coursebuildSearch.take("index","",')
    listing = json.loads(text.partition(',"",')[2].rstrip()[:-1])
    assert listing["strings"]["list"] == library.words("search.live.list")
    assert (listing["terms"], listing["words"], listing["kinds"]) == (1, 1, ["lesson"])
    for number in range(2):
        name = listing["files"][8 * number : 8 * number + 8]
        assert f"assets/search/{number:04x}.{name}.js" in files
    for number, (path, *values, file, place) in enumerate(listing["pages"]):
        assert values == [0, f"Title {path}", str(number)]
        text = files[f"assets/search/{file}.js"].make().decode()
        assert (text, place) == (f'coursebuildSearch.take("page","",["text of {path}"])\n', 0)
    # Keys stand in lines whose fields are parted by blanks.
    assert not [file.key for file in files.values() if len(file.key.split()) != 1]


def test_pages_that_are_alike_have_files_of_their_own(library: Library) -> None:
    page = {"same": 4}
    files = search_site(library, {"lessons/a.html": page, "lessons/b.html": page})
    assert len([path for path in files if path.count(".") == 1 and "assets" in path]) == 2


def test_levels_and_planned_lessons_share_files_of_texts(library: Library) -> None:
    for kind in ("level", "stub"):
        files = search_site(library, course(40, words=1), kind=kind)
        listing = json.loads(files[LIST].make().decode().partition(',"",')[2].rstrip()[:-1])
        assert len({page[4] for page in listing["pages"]}) == 3
        for path, *_, file, place in listing["pages"]:
            text = files[f"assets/search/{file}.js"].make().decode()
            assert json.loads(text.partition(',"",')[2].rstrip()[:-1])[place] == f"text of {path}"


SHARED_CASES = json.loads(
    (Path(__file__).parents[3] / "site" / "tests" / "search-words.json").read_text("utf-8")
)


def test_terms_are_those_that_the_browser_makes() -> None:
    assert [[text, terms_of(text)] for text, _ in SHARED_CASES["terms"]] == SHARED_CASES["terms"]


def test_lengths_of_terms() -> None:
    words = {length: "a" * length for length in (2, 3, 24, 25, 48, 49)}
    assert [n for n, word in words.items() if terms_of(word) == [word]] == [2, 3, 24, 25, 48]
    assert [n for n, word in words.items() if is_fuzzy(word)] == [3, 24]


def test_shelves_are_those_of_the_browser() -> None:
    for term, shelf, fuzzy, _ in SHARED_CASES["shelves"]:
        assert (shelf_of(term), is_fuzzy(term)) == (shelf, fuzzy), term


PARTS = (
    *("a", "s", "'s", "’s", "é", "λ", "\n", ".", "_", "1", "1e-5", "2.5E+3x", "E", "e+", " ", "×"),
    *("…", "–", "ﬁ", "ſ", "\x1c", "½", "a\u0301", "\u0301", "İ", "中文", "x.y", "__a__", "1.2.3"),
)


@given(st.text() | st.lists(st.sampled_from(PARTS), max_size=20).map("".join))
def test_any_text_has_terms_that_lines_can_hold(text: str) -> None:
    terms = terms_of(text)
    assert count_terms(text) == {term: terms.count(term) for term in terms}
    for term in terms:
        assert term and not {" ", "\n", "\0"} & {*term}
        assert shelf_of(term)


def test_a_formula_as_text(rewriting: bool) -> None:
    def convert(formula: str) -> list[str]:
        text, names = plain_formula(formula)
        return [text, f"names: {' '.join(names)}"] if names else [text]

    check_lines(Path(__file__).with_name("formulas.md"), convert, rewriting=rewriting)
    assert plain_formula("{" * 3000 + "x" + "}" * 3000) == ("x", ())


@given(st.text(alphabet=r"\{}_^&~'% abαomegfrct1-+=()", max_size=60))
def test_any_formula_can_be_read(formula: str) -> None:
    text, names = plain_formula(formula)
    assert "{" not in text or r"\{" in formula
    assert all(name.isalpha() for name in names)


LESSON = fixture_text("documents/searched.md")


def sections_of(make: Make, text: str) -> tuple[Section, ...]:
    rendered_course = make(text)
    library = rendered_course.library()
    document = library.lessons["0.1"].document
    return page_sections(inputs_of(library, "lesson", "0.1"), document, "")


def inputs_of(library: Library, kind: str, id: str = "") -> PageInputs:
    of_kind = (page for page in page_list(library) if page.kind == kind)
    pages = (page for page in of_kind if id in ("", page.id))
    return next(pages).inputs(library)


def pieces(section: Section) -> list[tuple[str, str]]:
    return [(piece.kind, piece.text) for piece in section.pieces]


def test_a_lesson_by_its_sections(make: Make) -> None:
    sections = sections_of(make, LESSON)
    heads = [(s.anchor, s.heading, s.level) for s in sections]
    assert heads == [
        ("", "", 0),
        ("out", "Outer", 2),
        ("inner-bold", "Inner bold", 3),
        ("empty", "Empty", 2),
    ]
    start, outer, inner, empty = sections
    assert pieces(start) == [
        ("text", "A body falls."),
        ("text", "free fall, drop"),
        ("text", "Say what falls"),
        ("text", "Measure it"),
        ("text", "Before any heading, at I_xx."),
    ]
    assert pieces(outer) == [
        ("text", "One mj_step item"),
        ("text", "Two"),
        ("text", "Warning: Mind"),
        ("text", "In a callout."),
    ]
    assert pieces(inner)[:5] == [
        ("formula", "τ = L"),
        ("text", "Some letters."),
        ("text", "h | k"),
        ("text", "a | b"),
        ("code", "import mujoco"),
    ]
    assert inner.names == ("dot", "examples/a.py")
    assert pieces(empty) == [("text", "raw text & more"), ("text", "A note.")]


def test_a_symbol_is_found_where_it_is_defined(make: Make) -> None:
    (section,) = sections_of(make, 'With $\\mu${symbol="friction"} and $m$.')
    assert (section.names, section.symbols) == (("friction",), ("μ",))


def test_a_quiz_gives_no_answer_away(make: Make) -> None:
    texts = [text for section in sections_of(make, LESSON) for _, text in pieces(section)]
    at = texts.index("Check")
    assert texts[at + 1 : at + 7] == ["Which one?", "This", "That", "Sort", "alpha", "zeta"]
    assert not any("secret" in text for text in texts)


def test_pages_that_are_searched_and_that_are_not(make: Make) -> None:
    rendered_course = make("Text.")
    library = rendered_course.library()
    for kind in ("home", "notfound", "search", "offline", "progress"):
        assert note_page(inputs_of(library, kind), None, "<p>Text</p>") == b"", kind
    planned = inputs_of(library, "lesson", "1.2")
    assert page_sections(planned, None, "<p>Other</p>") == (
        Section("", "", 0, (SectionPiece("text", "Comes later."),)),
    )
    assert b"Lessons" not in note_page(inputs_of(library, "level", "0"), None, "<p>Lessons</p>")
    model = page_sections(inputs_of(library, "model", "box"), None, "<h2 id='x'>Facts</h2>")
    assert model[0].pieces[-1].text.startswith('<mujoco model="box">')
    assert model[1] == Section("x", "Facts", 2, ())


def test_terms_have_weights_by_place_and_frequency(make: Make) -> None:
    piece = SectionPiece("text", "body body body body; inertia")
    code = SectionPiece("code", "body mj_step " + "x1 " * 10 + "y1 " * 9 + "z1 " * 4 + "w1 " * 3)
    sections = (Section("a", "Inertia", 2, (piece, code), ("frac",), ("I_0",)),)
    lines = weigh_terms(["4.2", "Body"], sections).decode().split("\n")
    assert lines == sorted(lines, key=lambda line: line[1:])
    assert {line[1:]: line[0] for line in lines} == {
        "4.2": "c",
        "body": "e",
        "inertia": "9",
        "i_0": "8",
        "i0": "8",
        "frac": "0",
        "mj_step": "0",
        "mjstep": "0",
        "mj": "0",
        "step": "0",
        "x1": "3",
        "y1": "2",
        "z1": "2",
        "w1": "1",
    }


def test_the_text_of_a_page_is_in_plain_values(make: Make) -> None:
    rendered_course = make('## `<img src=x onerror="alert(1)">`\n\n`</script>` & \u2028 `\x07`.\n')
    library = rendered_course.library()
    note = note_page(inputs_of(library, "lesson", "0.1"), rendered_course.page(), "")
    text = text_and_terms(note)[0].decode()
    sections = json.loads(text)
    assert sections[-1][1] == '<img src=x onerror="alert(1)">'
    assert sections[-1][3] == [["t", "</script> & \x07."]]


def test_a_drawn_page_by_its_headings(rewriting: bool) -> None:
    def convert(body: str) -> Iterator[str]:
        reader = SectionReader()
        reader.html(body)
        for section in reader.end():
            yield f"#{section.anchor} {section.level} {section.heading}"
            yield from (f"- {piece.kind}: {piece.text}" for piece in section.pieces)

    check_lines(Path(__file__).with_name("drawn.md"), convert, rewriting=rewriting)
