"""JavaScript as tokens: what is known, and what is refused in which words."""

from __future__ import annotations

import pytest

from coursebuild.labs.javascript_tokens import Token, UntranslatableError, tokenize


def tokens(code: str) -> list[str]:
    """The tokens in words; one after the end of a line is marked by `↵`."""
    found = tokenize(code)
    assert (found[-1].kind, found[-1].text) == ("end", "")
    return ["↵" * one.after_newline + f"{one.kind} {one.text}".strip() for one in found[:-1]]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("a1 $b _c", ["name a1", "name $b", "name _c"]),
        ("1 0x1F 0o17 0b11 1_000 .5 2. 1e-3", [
            "number 1", "number 0x1F", "number 0o17", "number 0b11", "number 1_000",
            "number .5", "number 2.", "number 1e-3",
        ]),
        ("a>>>=b===c", ["name a", "punctuator >>>=", "name b", "punctuator ===", "name c"]),
        ("'a\\'b' \"\\u0041\\x42\\u{43}\\n\"", ["string a'b", "string ABC"]),
        ("a\nb // c\n\n/* d */ e", ["name a", "↵name b", "↵name e"]),
        ("a /*\n*/ b\u2028c", ["name a", "↵name b", "↵name c"]),
        ("a\nb c", ["name a", "↵name b", "name c"]),
        ("a\n`b` c", ["name a", "↵template `b`", "name c"]),
        ("", []),
    ],
)  # fmt: skip
def test_code_becomes_tokens(code: str, expected: list[str]) -> None:
    assert tokens(code) == expected


def test_a_template_holds_its_texts_and_the_tokens_of_its_expressions() -> None:
    (template, _) = tokenize("`a\\n${b + {c: 1}.c}d${`${e}`}`")
    first, inner, second, deeper = template.parts
    assert (first, second) == ("a\n", "d")
    assert isinstance(inner, tuple) and isinstance(deeper, tuple)
    assert [one.text for one in inner] == ["b", "+", "{", "c", ":", "1", "}", ".", "c", ""]
    assert deeper[0].parts == ((Token("name", "e", False), Token("end", "", False)),)


def test_templates_nest_21_deep() -> None:
    def nested(count: int) -> str:
        return "`${" * count + "1" + "}`" * count

    assert tokens(nested(21)) == [f"template {nested(21)}"]
    with pytest.raises(UntranslatableError, match="nested too deeply"):
        tokenize(nested(22))


def test_line_ends_in_a_template_are_line_feeds() -> None:
    assert tokenize("`a\r\nb\rc`")[0].parts == ("a\nb\nc",)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("a\\u0062 = 1", "an escape in a name"),
        ("a\\", "an escape in a name"),
        ("\\u0061", "`\\`"),
        ("é", "`é`"),
        ("#x", "`#`"),
        ("'a", "`'`"),
        ("'a\nb'", "`'`"),
        ("010", "the number `01`"),
        ("1n", "the number `1n`"),
        ("1\\", "the number `1\\`"),
        ("1$", "the number `1$`"),
        ("'\\ud800'", "the escape `\\ud800`"),
        ("'\\u{110000}'", "the escape `\\u{110000}`"),
        ("'\\1'", "the escape `\\1`"),
        ("'\\01'", "the escape `\\0`"),
        ("'\\x4'", "the escape `\\x`"),
        ("`a\\\nb`", "a template with a line that goes on"),
        ("`a", "a template with a line that goes on"),
        ("`${a", "code that ends too early"),
    ],
)
def test_what_is_not_known_is_refused(code: str, message: str) -> None:
    with pytest.raises(UntranslatableError) as refused:
        tokenize(code)
    assert str(refused.value) == message
