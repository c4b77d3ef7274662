"""The parts of long scripts that are folded."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.listings import HEAD, LONG, Part, find_imports, fold


def function(name: str, lines: int) -> str:
    return f"def {name}():\n" + "    x = 1\n" * (lines - 1)


HEADER = '"""Title.\n\nText\n"""\n\nimport math\nfrom a import b\n\n'
GUARD = 'if __name__ == "__main__":\n    one()\n'


def test_head_and_rest_are_folded_and_the_guard_stays() -> None:
    code = HEADER + "G: float = 9.81\n\n" + function("one", 40) + "\n\n" + function("two", 20)
    code += "Z = 3\n\n\n" + GUARD
    assert fold(code) == (
        Part(1, 10, True, docstring=True, imports=True, names=("G",)),
        Part(11, 50, False),
        Part(51, 75, True, names=("two", "Z")),
        Part(76, 77, False),
    )


def test_modules_that_a_script_imports() -> None:
    code = (
        "import a.b as c, d\nfrom e.f import g\nfrom . import h\nfrom .i import j\n"
        "try:\n    import k\nexcept ImportError:\n    import l\nelse:\n    import m\n"
        "finally:\n    import n\ndef go():\n    if True:\n        from o import *\n"
        "match 1:\n    case 1:\n        import p\n"
    )
    assert find_imports(code) == frozenset("adeklmnop")
    assert find_imports(f"{code}(") == frozenset()


def test_assignments_are_no_constants_where_something_is_done_at_once() -> None:
    code = HEADER + "a = 1\nprint(a)\n" * 30
    assert fold(code)[0] == Part(1, 8, True, docstring=True, imports=True)


def test_decorators_and_comments_stay_with_what_they_belong_to() -> None:
    code = function("one", 44) + "\n# About two.\n# More.\n@cache\n" + function("two", 20)
    parts = fold(code)
    assert parts == (Part(1, 44, False), Part(45, 68, True, names=("two",)))
    assert code.split("\n")[parts[1].first] == "# About two."


def test_44_lines_of_the_rest_are_shown_and_no_more() -> None:
    rest = function("three", 20)
    fits = function("one", 20) + function("two", 24)
    assert fold(fits + rest) == (Part(1, 44, False), Part(45, 64, True, names=("three",)))
    longer = function("one", 20) + function("two", 25)
    assert fold(longer + rest) == (Part(1, 20, False), Part(21, 65, True, names=("two", "three")))


def test_a_remainder_is_folded_from_12_lines_on() -> None:
    assert fold(function("one", 44) + function("two", 11)) == (Part(1, 55, False),)
    parts = (Part(1, 44, False), Part(45, 56, True, names=("two",)))
    assert fold(function("one", 44) + function("two", 12)) == parts


def test_a_guard_of_up_to_12_lines_stays() -> None:
    code = function("one", 44) + function("two", 20) + 'if __name__ == "__main__":\n'
    parts = (Part(1, 44, False), Part(45, 64, True, names=("two",)), Part(65, 76, False))
    assert fold(code + "    one()\n" * 11) == parts
    assert fold(code + "    one()\n" * 12)[1:] == (Part(45, 77, True, names=("two",)),)


@pytest.mark.parametrize(
    "code",
    [
        HEADER + function("one", LONG - 8),
        function("one", 44) + function("two", 6),
        function("one", 300),
        "(\n" * 50,  # which does not parse
        "\n",
        "a = 1; b = 2\n" * 60,
    ],
)
def test_what_has_no_part_to_fold_is_shown_whole(code: str) -> None:
    assert fold(code) == (Part(1, code.count("\n"), False),)


STATEMENTS = st.sampled_from(
    [
        "import a\n",
        "x = 1\n",
        "\n",
        "# note\n",
        function("f", 9),
        function("g", 30),
        GUARD,
        '"""d"""\n',
    ]
)


@given(st.lists(STATEMENTS, max_size=30))
def test_parts_follow_each_other_and_cover_the_script(pieces: list[str]) -> None:
    code = "".join(pieces)
    parts = fold(code)
    assert parts[0].first == 1
    assert parts[-1].last == max(code.count("\n"), 1)
    for previous, next_part in itertools.pairwise(parts):
        assert next_part.first == previous.last + 1
        assert previous.folded or next_part.folded
    assert any(not part.folded for part in parts)
    assert all(part.last - part.first + 1 >= HEAD for part in parts if part.folded)
