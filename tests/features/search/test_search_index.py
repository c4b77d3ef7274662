"""The files of the index: what they hold, how few an edit touches, and that nothing else counts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.added_files import NotedPage, SiteContext
from coursebuild.core.pages.library import Library
from coursebuild.features.search import index
from coursebuild.features.search.index import IndexPlan, search_files
from coursebuild.features.search.words import is_fuzzy
from support.rendered_course import Make

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"


@pytest.fixture(scope="module")
def library(make: Make) -> Library:
    made = make("Text.")
    return Library.of(made.course, made.results, made.assets)


class Shelf(dict[str, bytes]):
    """Keeps what is made."""

    def get_or_create(self, key: str, make: Callable[[], bytes]) -> bytes:
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


def made(
    library: Library, terms: dict[str, dict[str, int]], shelf: Shelf | None = None
) -> dict[str, CachedFile]:
    notes = {
        path: b"text of " + path.encode() + b"\0" + lines(found) for path, found in terms.items()
    }
    pages = tuple(
        NotedPage(path, "lesson", path[8:-5], f"Title {path}", hashlib.sha256(note).hexdigest())
        for path, note in notes.items()
    )
    shelf = Shelf() if shelf is None else shelf
    keep = shelf.get_or_create
    site = SiteContext(library, None, None, pages, notes.__getitem__, keep, {}, None)  # type: ignore[arg-type]
    return {file.path: file for file in search_files(site)}


def lines(terms: dict[str, int]) -> bytes:
    return "\n".join(f"{weight:x}{term}" for term, weight in sorted(terms.items())).encode()


def decoded(data: bytes) -> dict[str, list[tuple[int, int]]]:
    """A shard by its terms, as the browser reads it."""
    text = json.loads(data.decode().partition(",")[2].partition(",")[2].rstrip()[:-1])
    found: dict[str, list[tuple[int, int]]] = {}
    for line in text.split("\n") if text else ():
        term, _, digits = line.partition(" ")
        page = value = shift = 0
        pages = []
        for digit in digits:
            value |= (DIGITS.index(digit) & 31) << shift
            shift += 5
            if not DIGITS.index(digit) & 32:
                page += value >> 4
                pages.append((page, value & 15))
                value = shift = 0
        found[term] = pages
    return found


def shards(files: dict[str, CachedFile]) -> dict[int, dict[str, list[tuple[int, int]]]]:
    return {
        int(path.split("/")[-1].split(".")[0], 16): decoded(file.make())
        for path, file in files.items()
        if path.count(".") == 2 and path.startswith("assets/search/")
    }


@pytest.mark.parametrize("pages", [1, 3, 40, 150])
def test_every_term_stands_once_where_the_browser_looks(library: Library, pages: int) -> None:
    terms = course(pages)
    plan = IndexPlan.of(pages)
    found = shards(made(library, terms))
    assert sorted(found) == list(range(plan.terms + plan.words))
    expected: dict[str, list[tuple[int, int]]] = {}
    for number, weights in enumerate(terms.values()):
        for term, weight in weights.items():
            expected.setdefault(term, []).append((number, weight))
    seen: dict[str, list[tuple[int, int]]] = {}
    for shard in range(plan.terms):
        for term, said in found[shard].items():
            assert plan.places(term)[0] == shard
            assert term not in seen
            seen[term] = said
    assert seen == expected
    alone = {term for n in range(plan.terms, plan.terms + plan.words) for term in found[n]}
    assert alone == {term for term in expected if is_fuzzy(term)}


def test_an_edit_sorts_few_pages_and_makes_few_shards(library: Library) -> None:
    terms, shelf = course(400), Shelf()
    before = made(library, terms, shelf)
    kept = len(shelf)
    terms["lessons/7.html"]["brandnew"] = 4
    after = made(library, terms, shelf)
    assert len(shelf) == kept + 1
    assert len(after.keys() - before.keys()) == 3, "the term's shard, that of spellings, the text"
    changed = {p for p, f in after.items() if p in before and before[p].key != f.key}
    assert changed == {"search/index.js"}
    clean = made(library, terms)
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
    files = made(library, terms)
    first = {path: (file.key, file.make()) for path, file in files.items()}
    assert first == {path: (f.key, f.make()) for path, f in made(library, terms).items()}
    counted = sum(len(said) for shard in shards(files).values() for said in shard.values())
    assert counted == sum(map(len, terms.values()))


def test_the_list_of_pages_says_where_everything_is(library: Library) -> None:
    files = made(library, course(5))
    text = files[index.LIST].make().decode()
    assert text.startswith('coursebuildSearch.take("index","",')
    listing = json.loads(text.partition(',"",')[2].rstrip()[:-1])
    assert listing["strings"]["list"] == library.words("search.live.list")
    assert (listing["terms"], listing["words"], listing["kinds"]) == (1, 1, ["lesson"])
    for number in range(2):
        name = listing["files"][8 * number : 8 * number + 8]
        assert f"assets/search/{number:04x}.{name}.js" in files
    for number, (path, *said, file) in enumerate(listing["pages"]):
        assert said == [0, f"Title {path}", str(number)]
        assert files[f"assets/search/{file}.js"].make() == b"text of " + path.encode()
    # Keys stand in lines whose fields are parted by blanks.
    assert not [file.key for file in files.values() if len(file.key.split()) != 1]


def test_pages_that_are_alike_have_files_of_their_own(library: Library) -> None:
    page = {"same": 4}
    files = made(library, {"lessons/a.html": page, "lessons/b.html": page})
    assert len([path for path in files if path.count(".") == 1 and "assets" in path]) == 2
