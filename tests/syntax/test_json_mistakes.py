"""Text that is no JSON: what an author is told, and where."""

from __future__ import annotations

import pytest

from coursebuild.syntax.json_text import MAX_DEPTH
from support.json_texts import parse
from support.positioned_nodes import shown

DOUBLE = "to write a backslash, double it: "
READ = f"is read as a control character [{DOUBLE}"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # the text as a whole
        (
            "",
            [
                "1:1-1 json-syntax: the block is empty: a JSON object is expected"
                ' [write `{"field": value, …}`]'
            ],
        ),
        (
            " \n\t ",
            [
                "1:1-1 json-syntax: the block is empty: a JSON object is expected"
                ' [write `{"field": value, …}`]'
            ],
        ),
        ('{"a": 1} x', ["1:10-11 json-syntax: text after the end of the JSON value"]),
        ('{"a": 1}\n\n{"b": 2}', ["3:1-9 json-syntax: text after the end of the JSON value"]),
        ('{"a": 1}}', ["1:9-10 json-syntax: `}` closes nothing"]),
        # commas and brackets
        ('{"a": 1,}', ["1:8-9 json-syntax: a comma before `}` [remove the comma]"]),
        ("[1, 2,\n]", ["1:6-7 json-syntax: a comma before `]` [remove the comma]"]),
        (
            "[1,, 2]",
            ["1:4-5 json-syntax: two commas with no value between them [remove one]"],
        ),
        (
            '{"a": "x"\n "b": 2}',
            ["1:10-10 json-syntax: a comma is missing here [put `,` between the two values]"],
        ),
        (
            '[{"a": 1}\n {"b": 2}]',
            ["1:10-10 json-syntax: a comma is missing here [put `,` between the two values]"],
        ),
        ('{"a": [1, 2}', ["1:12-13 json-syntax: expected `,` or `]`, found `}`"]),
        ('{"a": {"b": 1}', ["1:1-2 json-syntax: `{` is never closed"]),
        ('{"a": [1, 2', ["1:7-8 json-syntax: `[` is never closed"]),
        ("[", ["1:1-2 json-syntax: `[` is never closed"]),
        ("{", ["1:1-2 json-syntax: `{` is never closed"]),
        ('{"a"', ["1:4-5 json-syntax: the JSON ends where `:` after the key `a` is expected"]),
        ('{"a":\n', ["1:5-6 json-syntax: the JSON ends where a value is expected"]),
        ('{"a" 1}', ["1:6-7 json-syntax: expected `:` after the key `a`, found `1`"]),
        ('{"a" = 1}', ["1:6-7 json-syntax: `=` where JSON has `:` [write `:`]"]),
        (
            "[1; 2]",
            ["1:3-4 json-syntax: expected `,` or `]`, found `;` [JSON separates values by `,`]"],
        ),
        ('{"a": }', ["1:7-8 json-syntax: expected a value, found `}`"]),
        (
            '{"a": (1, 2)}',
            ["1:7-8 json-syntax: expected a value, found `(` [a list stands between `[` and `]`]"],
        ),
        # quotes
        (
            "{“a”: 1}",
            [
                "1:2-3 json-syntax: expected a key in double quotes, found `“`"
                ' [JSON knows only the straight quote `"`; replace the curly ones of this block]'
            ],
        ),
        (
            "{'a': 1}",
            [
                "1:2-3 json-syntax: expected a key in double quotes, found `'`"
                ' [JSON strings stand between double quotes: `"…"`]'
            ],
        ),
        (
            "{\"a\": 'x'}",
            [
                "1:7-8 json-syntax: expected a value, found `'`"
                ' [JSON strings stand between double quotes: `"…"`]'
            ],
        ),
        (
            "{title: 1}",
            ['1:2-7 json-syntax: expected a key in double quotes, found `title` [write `"title"`]'],
        ),
        (
            '{"a": Mass and inertia}',
            [
                "1:7-11 json-syntax: expected a value, found `Mass`"
                " [text stands between double quotes]"
            ],
        ),
        (
            '{"q": "the "best" one"}',
            [
                "1:13-17 json-syntax: expected `,` or `}`, found `best`"
                ' [a double quote inside a string is written `\\"`]'
            ],
        ),
        (
            '{"a": "x\n"}',
            [
                "1:7-9 json-syntax: the string is not closed on its line"
                ' [close it with `"`; a line end inside a string is written `\\n`]'
            ],
        ),
        (
            '{"a": "x',
            [
                "1:7-9 json-syntax: the string is not closed on its line"
                ' [close it with `"`; a line end inside a string is written `\\n`]'
            ],
        ),
        # words
        ('{"a": True}', ["1:7-11 json-syntax: `True` is not JSON [write `true`]"]),
        (
            "[False, None]",
            [
                "1:2-7 json-syntax: `False` is not JSON [write `false`]",
                "1:9-13 json-syntax: `None` is not JSON [write `null`]",
            ],
        ),
        ("[NaN]", ["1:2-5 json-syntax: JSON has no `NaN` [write a finite number]"]),
        ("[-Infinity]", ["1:2-11 json-syntax: JSON has no `-Infinity` [write a finite number]"]),
        # numbers
        ("[01]", ["1:2-4 json-syntax: `01` is not a number of JSON [write `1`]"]),
        ("[-007.50]", ["1:2-9 json-syntax: `-007.50` is not a number of JSON [write `-7.50`]"]),
        ("[.5]", ["1:2-4 json-syntax: `.5` is not a number of JSON [write `0.5`]"]),
        ("[5.]", ["1:2-4 json-syntax: `5.` is not a number of JSON [write `5`]"]),
        ("[+5]", ["1:2-4 json-syntax: `+5` is not a number of JSON [write `5`]"]),
        ("[1e]", ["1:2-4 json-syntax: `1e` is not a number of JSON"]),
        ("[-]", ["1:2-3 json-syntax: `-` is not a number of JSON"]),
        ("[1_000]", ["1:2-7 json-syntax: `1_000` is not a number of JSON [write `1000`]"]),
        (
            "[0x1F]",
            ["1:2-6 json-syntax: `0x1F` is not a number of JSON [JSON has decimal numbers only]"],
        ),
        ("[3.14.0]", ["1:2-8 json-syntax: `3.14.0` is not a number of JSON"]),
        ("[٣]", ["1:2-3 json-syntax: expected a value, found `٣`"]),
        ("[1٣]", ["1:2-4 json-syntax: `1٣` is not a number of JSON"]),
        ("[" + "9" * 5000 + "]", ["1:2-5002 json-syntax: a number of 5000 digits is too long"]),
        # comments and spaces
        ('{"a": 1 // one\n}', ["1:9-15 json-syntax: JSON has no comments [remove it]"]),
        ('# all\n{"a": 1}', ["1:1-6 json-syntax: JSON has no comments [remove it]"]),
        ("[1, /* two\nlines */ 2]", ["1:5-11 json-syntax: JSON has no comments [remove it]"]),
        (
            "[1,\u00a02]",
            [
                "1:4-5 json-syntax: U+00A0 (no-break space) is not white space in JSON"
                " [replace it by a plain space, or remove it]"
            ],
        ),
        (
            "\ufeff[]",
            [
                "1:1-2 json-syntax: U+FEFF (zero width no-break space) is not white space in JSON"
                " [replace it by a plain space, or remove it]"
            ],
        ),
        # inside strings
        (
            r'["\omega"]',
            [f"1:3-5 json-syntax: `\\o` is not an escape of JSON [{DOUBLE}`\\\\omega`]"],
        ),
        (r'["\("]', [f"1:3-5 json-syntax: `\\(` is not an escape of JSON [{DOUBLE}`\\\\`]"]),
        (
            r'["\upsilon"]',
            [
                "1:3-5 json-syntax: `\\u` is not followed by four hexadecimal digits"
                f" [{DOUBLE}`\\\\upsilon`]"
            ],
        ),
        (
            r'["\u12"]',
            [
                "1:3-5 json-syntax: `\\u` is not followed by four hexadecimal digits"
                " [write four hexadecimal digits after `\\u`]"
            ],
        ),
        (
            r'["\ud83d!"]',
            ["1:3-9 json-syntax: `\\ud83d` is half of a character [write the character itself]"],
        ),
        (
            r'["\ude00\ud83d"]',
            [
                "1:3-9 json-syntax: `\\ude00` is half of a character [write the character itself]",
                "1:9-15 json-syntax: `\\ud83d` is half of a character [write the character itself]",
            ],
        ),
        (
            '["\ud83d"]',
            ["1:3-4 json-syntax: U+D83D is half of a character [write the character itself]"],
        ),
        ('["a\tb"]', ["1:4-5 json-syntax: a tab inside a string [write `\\t`, or a space]"]),
        (
            '["a\x01b"]',
            [
                "1:4-5 json-syntax: the control character U+0001 inside a string"
                " [write `\\u0001`, or remove it]"
            ],
        ),
        # TeX that is a valid escape
        (
            r'["$\tau$"]',
            [f"1:4-8 field-value: `\\t` of `\\tau` {READ}`\\\\tau`]"],
        ),
        (
            r'["$\frac12 \beta \rho$"]',
            [
                f"1:4-9 field-value: `\\f` of `\\frac` {READ}`\\\\frac`]",
                f"1:12-17 field-value: `\\b` of `\\beta` {READ}`\\\\beta`]",
                f"1:18-22 field-value: `\\r` of `\\rho` {READ}`\\\\rho`]",
            ],
        ),
        (
            r'["$\nabla f$"]',
            [f"1:4-10 field-value: `\\n` of `\\nabla` {READ}`\\\\nabla`]"],
        ),
        # keys
        ('{"a": 1, "b": 2, "a": 3}', ["1:18-21 field-repeated: `a` is given twice"]),
        (r'{"a": 1, "\u0061": 3}', ["1:10-18 field-repeated: `a` is given twice"]),
        # several at once
        (
            '{"a": True,\n "b": "\\p",\n "c": [01,],\n "a": 1 // x\n}',
            [
                "1:7-11 json-syntax: `True` is not JSON [write `true`]",
                f"2:8-10 json-syntax: `\\p` is not an escape of JSON [{DOUBLE}`\\\\p`]",
                "3:8-10 json-syntax: `01` is not a number of JSON [write `1`]",
                "3:10-11 json-syntax: a comma before `]` [remove the comma]",
                "4:2-5 field-repeated: `a` is given twice",
                "4:9-13 json-syntax: JSON has no comments [remove it]",
            ],
        ),
    ],
)
def test_what_an_author_is_told(text: str, expected: list[str]) -> None:
    assert shown(parse(text).diagnostics) == expected


@pytest.mark.parametrize(
    "text",
    [
        r'"a\nabout"',  # a line end before a word, no formula
        r'"\nabla"',  # no dollar: not a text with formulas
        r'"costs $5 and $6\nnu"',
        r'"$x$\nnot"',  # after the formula
        r'"$x$\tabc"',
        r'"$\\tau$"',
        r'"a\r\n$b$"',
        r'"$a$ \b"',
    ],
)
def test_escapes_that_may_be_meant_are_left_alone(text: str) -> None:
    assert parse(text).diagnostics == ()


def test_notes_point_at_the_first_key_and_at_the_bracket() -> None:
    repeated = parse('{"a": 1,\n "a": 2}').diagnostics[0]
    assert [
        (n.message, n.span and n.span.text, n.span and n.span.line) for n in repeated.notes
    ] == [("the first one is here", '"a"', 1)]
    closed = parse('{"a":\n [1}').diagnostics[0]
    assert [(n.message, n.span and n.span.column) for n in closed.notes] == [
        ("`[` is opened here", 2)
    ]


def test_nesting_is_limited() -> None:
    fine = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert parse(fine).diagnostics == ()
    for opening in ("[", '{"a":'):
        deep = parse(opening * 100_000)
        assert deep.value is None
        at = len(opening) * MAX_DEPTH
        assert [(d.message, d.span.start) for d in deep.diagnostics] == [
            ("objects and arrays nest more than 64 deep", at)
        ]
