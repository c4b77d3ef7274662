"""What the pages of a course are drawn with, made of what the tool and its features bring."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from unicodedata import normalize

from msgspec.structs import replace

from coursebuild.core.model import Course
from coursebuild.core.model.course import ENGLISH, Words
from coursebuild.core.model.results import Formula, MathError, PublishedTrials, Reports, Results
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import (
    DEFAULT_LANGUAGE,
    Renderer,
    Strings,
    Texts,
    parse_strings,
    templates_of,
)
from coursebuild.core.registry import feature_trials, features, publish_trials


def make_library(
    course: Course,
    results: Results,
    assets: Assets,
    reports: Reports,
    trials: PublishedTrials | None = None,
) -> Library:
    """The library of a course; `trials` are what is published of trials, if it is known already."""
    renderer = renderer_for(
        assets,
        course.language,
        course.theme.template_texts,
        dict(results.formulas),
        is_manual=course.is_manual,
    )
    trials = trials or publish_trials(results, assets)
    course_trials = feature_trials(course) if trials.values else {}
    blocks = {name: trial.block for name, (_, trial) in course_trials.items()}
    values = {
        (blocks[name].span.path, blocks[name].span.start): value
        for name, value in trials.values.items()
        if name in blocks
    }
    return Library(course, results, assets, renderer, reports, values, trials.files)


def in_language(library: Library, language: str) -> Library:
    """The library with the words of a language, kept beside that of the course."""
    if language == library.words.language:
        return library
    versions: dict[str, Library] = library.__dict__.setdefault("versions", {})
    if language not in versions:
        renderer = renderer_for(
            library.assets,
            language,
            library.course.theme.template_texts,
            library.renderer.formulas,
            is_manual=library.course.is_manual,
        )
        versions[language] = replace(library, renderer=renderer)
    return versions[language]


def renderer_for(
    assets: Assets,
    language: str,
    course_templates: Texts = (),
    formulas: Mapping[Formula, str | MathError] = {},
    *,
    is_manual: bool = False,
) -> Renderer:
    """The renderer of pages in a language, with the templates of a course and of the tool."""
    templates = templates_of(assets.templates, assets.compiled_templates, course_templates)
    words = strings_for(assets.templates, language)
    return Renderer(words.prefer("manual.") if is_manual else words, templates, formulas)


def strings_for(templates: tuple[tuple[str, str], ...], language: str) -> Strings:
    """The interface texts of a language: for `pt-BR` its own, then those of `pt`, then English."""
    feature_texts = (feature.texts.items() for feature in features())
    return _strings_for(
        templates, tuple(text for texts in feature_texts for text in texts), language
    )


def words_for(templates: tuple[tuple[str, str], ...], language: str) -> Words:
    """The words by which texts of a language are read: its own, and the English ones."""
    strings, words = strings_for(templates, language), {}
    for field in {*Words.__struct_fields__} - {"macros"}:  # which no language has
        names = strings(f"words.{field}").split("|")
        forms = (normalize(form, name) for name in names for form in ("NFC", "NFD"))
        words[field] = tuple(dict.fromkeys((*forms, *getattr(ENGLISH, field))))
    return Words(**words)


@functools.lru_cache(maxsize=8)
def _strings_for(
    templates: tuple[tuple[str, str], ...],
    feature_texts: tuple[tuple[str, str], ...],
    language: str,
) -> Strings:
    strings = Strings({}, language)
    for name in dict.fromkeys((DEFAULT_LANGUAGE, language.split("-")[0].lower(), language)):
        for path, text in (*templates, *feature_texts):
            if path in (f"strings/{name}.toml", name):
                strings = parse_strings(text, strings, language)
    return strings
