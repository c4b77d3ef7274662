"""Translations of the interface: complete, with the same values, and forms for their numbers."""

from __future__ import annotations

import string
from pathlib import Path

import pytest

from coursebuild.core.pages.strings import (
    CATEGORIES,
    DEFAULT_LANGUAGE,
    category,
    parse_strings,
)

FOLDER = Path(__file__).parents[3] / "templates" / "strings"
LANGUAGES = sorted(p.stem for p in FOLDER.glob("*.toml") if p.stem != DEFAULT_LANGUAGE)
FORMS = {
    "ar": "zero one two few many other",
    "de": "one other",
    "en": "one other",
    "es": "one many other",
    "fr": "one many other",
}
"""The forms that numbers of things take in a language."""


def entries(language: str) -> dict[str, str]:
    return dict(parse_strings((FOLDER / f"{language}.toml").read_text("utf-8")).texts)


def with_forms(table: dict[str, str]) -> dict[str, dict[str, str]]:
    """Texts by key, each with its forms; a text without forms has one with an empty name."""
    forms_by_key: dict[str, dict[str, str]] = {}
    for key, text in table.items():
        stem, _, form = key.rpartition(".")
        if form in CATEGORIES and f"{stem}.other" in table:
            forms_by_key.setdefault(stem, {})[form] = text
        else:
            forms_by_key[key] = {"": text}
    return forms_by_key


def places(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_translation_is_complete_and_has_the_same_values(language: str) -> None:
    """A form for a single number may write it in words."""
    english, translation = with_forms(entries(DEFAULT_LANGUAGE)), with_forms(entries(language))
    assert sorted(english.keys() - translation.keys()) == [], "missing"
    assert sorted(translation.keys() - english.keys()) == [], "unknown"
    for key in english.keys() & translation.keys():
        fields = set().union(*map(places, english[key].values()))
        assert set().union(*map(places, translation[key].values())) == fields, key
        for form, text in translation[key].items():
            optional = {"n"} if form in ("zero", "one", "two") else set()
            assert fields - places(text) <= optional, f"{key}.{form}"
    forbidden = set("\u200b\u2066\u2067\u2068\u2069\u202a\u202b\u202c\u202d\u202e\ufeff")
    text = (FOLDER / f"{language}.toml").read_text("utf-8")
    assert not forbidden & set(text), "direction is a matter of the pages"


@pytest.mark.parametrize("language", [*LANGUAGES, "en"])
def test_a_text_has_the_forms_that_numbers_take_in_its_language(language: str) -> None:
    forms = FORMS[language].split()
    for key, texts in with_forms(entries(language)).items():
        assert [*texts] in ([""], sorted(forms)), key
    assert {category(language, n) for n in (*range(200), 10**6)} == {*forms}


@pytest.mark.parametrize("language", [*LANGUAGES, "en"])
def test_no_text_is_empty_or_in_want_of_a_space(language: str) -> None:
    for key, text in entries(language).items():
        assert text.strip(), key
        assert key == "zip.readme" or (text == text.strip() and "  " not in text), key
