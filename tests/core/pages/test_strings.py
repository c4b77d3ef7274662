"""The interface's words and their translations: complete, all used, with forms for numbers."""

from __future__ import annotations

import re
import string
from pathlib import Path
from unicodedata import normalize

import pytest

from coursebuild.core.model import (
    Link,
    Paragraph,
    Recording,
    Table,
    find_blocks,
    find_inlines,
    plain_text,
)
from coursebuild.core.model.course import ENGLISH
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.materials import strings_for, words_for
from coursebuild.core.pages.renderer import CATEGORIES, DEFAULT_LANGUAGE, category, parse_strings
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source

ROOT = Path(__file__).parents[3]


def test_texts_have_values_plural_forms_and_a_language_to_fall_back_on() -> None:
    english = parse_strings(
        '[a]\nb = "B {x}"\nc = "C"\n[a.n]\none = "{n} thing"\nother = "{n} things"\n'
    )
    german = parse_strings('[a]\nb = "B: {x}"\n', english)
    assert (german("a.b", x="<i>"), german("a.c")) == ("B: <i>", "C")
    assert (english("a.n", n=1), english("a.n", n=0)) == ("1 thing", "0 things")
    with pytest.raises(KeyError, match=r"a\.z"):
        english("a.z")


def test_a_regional_language_takes_the_general_one_first(assets: Assets) -> None:
    templates = (
        *assets.templates,
        ("strings/pt.toml", '[site]\nmap = "Mapa"\nmenu = "Menu"\n'),
        ("strings/pt-BR.toml", '[site]\nmenu = "Cardápio"\n'),
    )
    words = strings_for(templates, "pt-BR")
    assert (words("site.map"), words("site.menu")) == ("Mapa", "Cardápio")
    assert words("code.copy") == "Copy"


def test_numbers_that_are_inserted_have_the_decimal_sign_of_the_language(assets: Assets) -> None:
    arabic, german = (strings_for(assets.templates, language) for language in ("ar", "de"))
    assert german("lab.at", t=-1.5).endswith("t = −1,5 s")
    assert german("lab.at", t="-1.5").endswith("t = -1.5 s"), "as it was written"
    assert german.decimals("2.5 ms") == "2,5 ms"
    assert arabic.number(0.5) == "0.5", "the digits are not Arabic ones"


def test_lists_and_pairs_have_the_marks_of_the_language(assets: Assets) -> None:
    arabic, french = (strings_for(assets.templates, language) for language in ("ar", "fr"))
    assert arabic.join(["1.1", "1.2"]) == "1.1، 1.2"
    assert arabic("lab.stops", t=3) == "تتوقف عند \u20663 s\u2069."
    assert "t = 3 s" in arabic("lab.at", t=3)
    assert french("site.pair", first="Niveau 1", second="Chute") == "Niveau 1\u00a0: Chute"


def test_captions_and_mentions_follow_the_language(assets: Assets) -> None:
    """However letters with marks are typed; English ones hold too."""
    assert words_for(assets.templates, "en") == words_for(assets.templates, "pt") == ENGLISH
    for language, caption, mention, unlike, figure, table in (
        ("ar", "المخرجات:", "الدروس 1.1 و1.2", "المدخلات:", "الشكل:", "الجدول:"),
        ("de", "Ausgabe:", "Lektionen 1.1 und 1.2", "Aufgabe:", "Abbildung:", "Tabelle:"),
        ("de-CH", "Ausgabe :", "Lektion 1.1 und Stufe 1.2", "Angabe:", "Bild:", "Tabelle:"),
        ("es", "Salida:", "las lecciones 1.1 y 1.2", "Subida:", "Figura:", "Cuadro:"),
        (
            "fr",
            "Sortie\u202f:",
            "leçon 1.1 et Niveau 1.2",
            "Partie\u00a0:",
            "Figure :",
            "Tableau :",
        ),
        ("fr", "Output:", "Lessons 1.1, 1.2", "Outset:", "Figure:", "Table:"),
    ):
        words = words_for(assets.templates, language)
        for form in ("NFC", "NFD"):
            head = "```python file=examples/a.py\nprint(1)\n```\n\n"
            text = f"{head}{caption}\n\n```text\n1\n```\n\n{mention}\n\n{unlike}\n\n| a |\n| - |\n"
            source = Source("x.md", normalize(form, text))
            parsed_text = parse_document(source, frozenset(), lesson=True, words=words)
            assert parsed_text.diagnostics == (), language
            (recording,) = find_blocks(parsed_text.value, Recording)
            assert recording.caption == (), "it is shown in the language of the page"
            captions = (
                f"{figure} ![a](a.svg) *A* {{#fig:a}}\n\n{table} T {{#tab:b}}\n\n| a |\n| - |\n"
            )
            source = Source("y.md", normalize(form, captions))
            parsed_captions = parse_document(source, frozenset(), lesson=True, words=words)
            assert parsed_captions.diagnostics == (), language
            (paragraph,) = find_blocks(parsed_captions.value, Paragraph)
            assert plain_text(paragraph.children).split() == ["a", "A"]
            (caption_of_table,) = find_blocks(parsed_captions.value, Table)
            assert plain_text(caption_of_table.caption) == "T"
            links = find_inlines(parsed_text.value, Link)
            assert [getattr(link.target, "id", "") for link in links] == ["1.1", "1.2"], mention


def test_every_text_that_is_asked_for_exists_and_every_one_is_used(assets: Assets) -> None:
    """Keys that are made at run time are listed here by prefix."""
    run_time_prefixes = (
        "callout.",
        "overlay.",
        "promise.",
        "status.",
        "theme.",
        "words.",
    )
    run_time_prefixes += ("lab.live.", "preview.", "measured.reference_", "numerics.case_")
    run_time_prefixes += ("report.",)
    text = "".join(text for path, text in assets.templates if path.endswith(".html"))
    for folder in ("core/pages", "features"):
        modules = sorted((ROOT / "coursebuild" / folder).rglob("*.py"))
        text += "".join(path.read_text() for path in modules)
    scripts = "".join(p.read_text() for p in sorted((ROOT / "site" / "js").rglob("*.js")))
    words = strings_for(assets.templates, "en")
    keys = {re.sub(r"\.(one|other)$", "", key) for key in words.texts}
    quoted_keys = set(re.findall(r"""["']([a-z]+\.[a-z_.]+)["']""", text))
    called_keys = set(re.findall(r"""(?:\bt|words)\(\s*["']([a-z_.]+)["']""", text))
    assert called_keys - keys == {key for key in called_keys if key.endswith(".")}
    quoted_keys |= set(re.findall(r"""["'`]([a-z]+\.[a-z_.]+)["'`]""", scripts))
    unused = {key for key in keys - quoted_keys if not key.startswith(run_time_prefixes)}
    # Keys of tables are made from the table's name and words looked up in it.
    words_in_code = set(re.findall(r"[a-z]+", text + scripts))
    assert {key for key in unused if not set(re.split(r"[._]", key)) <= words_in_code} == set()


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
