"""In a preview too, a save redraws glossary, index of symbols and who refers to whom."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from support.live_course import Builds, Live
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import Folder

pytestmark = pytest.mark.site

ONE, TWO = "content/lessons/1.1-one.md", "content/lessons/1.2-two.md"


def test_terms_symbols_links_and_numbers_follow_the_text(
    make: Callable[..., Folder], live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make("## A\n\nText with $x$.\n", "## B\n\nText.\n")
    running = live(folder)

    def same(fast: bool, *paths: str) -> dict[str, bytes]:
        """Save; the pages are those of a build, and the fast way was taken if it could be."""
        assert running.save(*paths) is fast
        running.rebuild.once()
        built = builds(folder)
        assert built is not None
        pages = [path for path in built if path.startswith(("glossary/", "symbols/", "lessons/1."))]
        pages = [path for path in pages if path.endswith(".html")]
        for path in pages:
            assert running.find(path) == built[path], path
        for path in ("glossary/index.html", "symbols/index.html"):
            assert running.session.files.has_page(path) is (path in built)
        return {path: built[path] for path in pages}

    folder.replace(ONE, "Text", "A [thing]{term} is $q$. Text")
    assert "glossary/index.html" in same(True, ONE)
    folder.replace(TWO, "Text", 'The [thing](term:thing) of Lesson 1.1, $z${symbol="height"}')
    pages = same(True, TWO)
    assert b"Referred to by" in pages["lessons/1.1-one.html"]
    assert b"height" in pages["symbols/index.html"]
    folder.replace(ONE, "is $q$", "is $\\dot q$, so that\n\n$$a = b$$ {#eq:a}\n\nis")
    same(True, ONE)
    folder.replace(TWO, "height", "depth")
    folder.replace(TWO, "Lesson 1.1", "[](lesson:1.1#eq:a)")
    pages = same(True, TWO)
    assert b"(1) of Lesson 1.1" in pages["lessons/1.2-two.html"]
    folder.replace(ONE, "[thing]{term}", "thing")
    folder.replace(TWO, "[thing](term:thing)", "thing")
    assert "glossary/index.html" not in same(True, ONE, TWO)


def test_a_term_that_goes_makes_a_mistake_elsewhere_until_it_comes_back(
    make: Callable[..., Folder], live: Callable[[Folder], Live]
) -> None:
    folder = make("A [thing]{term} is.\n", "See [it](term:thing).\n")
    running = live(folder)
    assert running.wrong() == []
    folder.replace(ONE, "[thing]{term}", "thing")
    running.save(ONE)
    running.session.read()
    assert running.wrong() == ["link-term"]
    folder.replace(TWO, "See [it](term:thing)", "A [Thing]{term} is")
    running.save(TWO)
    assert running.wrong() == []
    folder.replace(ONE, "thing", "[thing]{term}")
    running.save(ONE)
    running.session.read()
    assert running.wrong() == ["term-repeated"]
