"""The files of the index: what they hold, how few an edit touches, and that nothing else counts."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.search import index
from coursebuild.core.pages.search.files import IndexEntry, SearchFiles
from coursebuild.core.pages.search.index import IndexPlan
from coursebuild.core.pages.search.words import is_fuzzy

DIGITS = {digit: value for value, digit in enumerate(index._DIGIT)}


class Shelf:
    """Counts what is made."""

    def __init__(self) -> None:
        self.kept: dict[str, bytes] = {}
        self.put_keys: list[str] = []

    def get(self, key: str) -> bytes | None:
        return self.kept.get(key)

    def put(self, key: str, data: bytes) -> None:
        self.kept[key] = data
        self.put_keys.append(key)


def course(pages: int, words: int = 40) -> dict[str, dict[str, int]]:
    """Terms with their weight, by page; some are common, some rare."""
    return {
        f"lessons/{n}.html": {
            f"term{'abcdefghij'[k % 10]}{n * k % 97}": (n + k) % 16 for k in range(words)
        }
        for n in range(pages)
    }


def made(terms: dict[str, dict[str, int]], shelf: Shelf) -> dict[str, CachedFile]:
    data = {
        path: "\n".join(f"{weight:x}{term}" for term, weight in sorted(found.items())).encode()
        for path, found in terms.items()
    }
    entries = [
        IndexEntry(path, "lesson", f"Title {path}", "", str(hash(text)))
        for path, text in data.items()
    ]
    files = SearchFiles(
        entries,
        {"list": "Results"},
        lambda path: b"text of " + path.encode(),
        lambda path: data[path],
        shelf,
    )
    return {file.path: file for file in files.files()}


def decoded(data: bytes) -> dict[str, list[tuple[int, int]]]:
    """A shard by its terms, as the browser reads it."""
    text = json.loads(data.decode().partition(",")[2].partition(",")[2].rstrip()[:-1])
    found: dict[str, list[tuple[int, int]]] = {}
    for line in text.split("\n") if text else ():
        term, _, digits = line.partition(" ")
        page = value = shift = 0
        pages = []
        for digit in digits:
            value |= (DIGITS[digit] & 31) << shift
            shift += 5
            if not DIGITS[digit] & 32:
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
def test_every_term_stands_once_where_the_browser_looks(pages: int) -> None:
    terms = course(pages)
    plan = IndexPlan.of(pages)
    found = shards(made(terms, Shelf()))
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


def test_the_plan_grows_with_the_course() -> None:
    plans = {pages: IndexPlan.of(pages) for pages in (0, 1, 80, 2000, 100_000)}
    assert plans[0] == plans[1] == IndexPlan(1, 1, 1)
    assert plans[80] == IndexPlan(4, 8, 1)
    assert plans[2000] == IndexPlan(64, 128, 16)
    assert plans[100_000].terms == 1024


def test_an_edit_makes_one_bucket_and_few_shards_anew() -> None:
    terms, shelf = course(400), Shelf()
    before = made(terms, shelf)
    for file in before.values():
        file.make()
    shelf.put_keys.clear()
    terms["lessons/7.html"]["brandnew"] = 4
    after = made(terms, shelf)
    assert len(shelf.put_keys) == 1, "the slices of one bucket"
    changed = {path for path, file in after.items() if path not in before}
    kinds = sorted(path.rpartition("/")[2][:5] for path in changed if path.endswith(".js"))
    assert len(kinds) == 3, "the term's shard, the shard of spellings, the page's text"
    assert {p for p, f in after.items() if p in before and before[p].key != f.key} == {
        f"search/index.js{copy}" for copy in ("", ".br", ".gz")
    }
    clean = made(terms, Shelf())
    assert {p: (f.key, f.make()) for p, f in after.items()} == {
        p: (f.key, f.make()) for p, f in clean.items()
    }


def test_a_damaged_entry_of_the_store_is_made_again() -> None:
    terms, shelf = course(90), Shelf()
    good = {path: file.make() for path, file in made(terms, shelf).items()}
    for damage in (b"", b"x", b"\0" * 7):
        for key in shelf.kept:
            shelf.kept[key] = damage
        assert {path: file.make() for path, file in made(terms, shelf).items()} == good


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
def test_the_files_follow_from_the_pages_alone(terms: dict[str, dict[str, int]]) -> None:
    first = {path: (file.key, file.make()) for path, file in made(terms, Shelf()).items()}
    assert first == {path: (f.key, f.make()) for path, f in made(terms, Shelf()).items()}
    found = shards(made(terms, Shelf()))
    counted = sum(len(said) for shard in found.values() for said in shard.values())
    assert counted == sum(map(len, terms.values()))


def test_the_list_of_pages_says_where_everything_is() -> None:
    files = made(course(5), Shelf())
    text = files["search/index.js"].make().decode()
    assert text.startswith('coursebuildSearch.take("index","",')
    listing = json.loads(text.partition(',"",')[2].rstrip()[:-1])
    assert listing["strings"] == {"list": "Results"}
    assert (listing["terms"], listing["words"], listing["kinds"]) == (1, 1, ["lesson"])
    for number in range(2):
        name = listing["files"][8 * number : 8 * number + 8]
        assert f"assets/search/{number:04x}.{name}.js" in files
    for path, kind, title, name, file in listing["pages"]:
        assert (kind, title, name) == (0, f"Title {path}", "")
        assert files[f"assets/search/{file}.js"].make() == b"text of " + path.encode()
    assert {path.partition(".js")[2] for path in files} == {"", ".br", ".gz"}
    # Keys stand in lines whose fields are parted by blanks.
    assert not [file.key for file in files.values() if len(file.key.split()) != 1]


def test_pages_that_are_alike_have_files_of_their_own() -> None:
    page = {"same": 4}
    files = made({"a.html": page, "b.html": page}, Shelf())
    texts = [f.make() for path, f in files.items() if path.count(".") == 1 and "assets" in path]
    assert texts == [b"text of a.html", b"text of b.html"]
