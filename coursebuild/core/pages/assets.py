"""The tool's own files: templates, interface texts, and the bundled files for browsers.

Entry points: `Assets`, a value made by who reads the disk; `strings_for`, `words_for`;
`hashed_name`.

1. `templates` holds every file of `templates/` as text, `dist` every file of the bundle as bytes,
   by path relative to their folder.
2. A file that a page refers to is published under a name with a hash of its content, so that a
   browser may keep it for ever.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping
from pathlib import Path
from unicodedata import normalize

from msgspec import Struct

from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.model.vocabulary import ENGLISH, Words
from coursebuild.core.pages.renderer import Renderer, Texts, templates_of
from coursebuild.core.pages.strings import DEFAULT_LANGUAGE, Strings, parse_strings
from coursebuild.core.registry import features

SCRIPTS = {
    "theme.js": "js/theme.js",
    "site.js": "js/site.js",
    "offline.js": "js/offline-page.js",
    "map.js": "js/map-page.js",
    "progress.js": "js/progress-page.js",
    "review.js": "js/review-page.js",
    "search.js": "js/search.js",
}
"""The published names of plain scripts of pages, with the bundled modules."""


class Assets(Struct, frozen=True):
    """Templates and bundled files, sorted by path."""

    templates: tuple[tuple[str, str], ...]
    """Path relative to `templates/`, and text."""
    dist: Mapping[str, bytes]
    """Path relative to the bundle (`css/site.css`, `js/site.js`, `fonts/fonts.json`, …), and
    bytes, perhaps read on access."""
    compiled_templates: Path | None = None
    """The folder of the compiled templates; see `templates_of`."""

    def renderer(
        self,
        language: str,
        course_templates: Texts = (),
        formulas: Mapping[Formula, str | MathError] = {},
    ) -> Renderer:
        """The renderer of pages in a language, with the templates of a course and of the tool."""
        templates = templates_of(self.templates, self.compiled_templates, course_templates)
        return Renderer(strings_for(self.templates, language), templates, formulas)

    def template(self, path: str) -> str:
        """The text of a file of `templates/` (`KeyError` where there is none)."""
        return dict(self.templates)[path]

    def file(self, path: str) -> bytes:
        """The bytes of a bundled file (`KeyError` where there is none)."""
        return self.dist[path]

    def files(self, folder: str) -> tuple[tuple[str, bytes], ...]:
        """The bundled files of a folder."""
        paths = (path for path in self.dist if path.startswith(f"{folder}/"))
        return tuple((path, self.dist[path]) for path in paths)


def hashed_name(path: str, data: bytes) -> str:
    """`assets/site.css` with eight digits of its content's hash: `assets/site.1b4f0e98.css`."""
    stem, dot, suffix = path.rpartition(".")
    digest = hashlib.sha256(data).hexdigest()[:8]
    return f"{stem}.{digest}.{suffix}" if dot else f"{path}.{digest}"


def page_script(code: bytes) -> bytes:
    """A bundled module without imports or exports as a plain script in a scope of its own.

    Browsers refuse to load modules from a disk, and plain scripts of a page share top-level names.
    """
    return b'"use strict";(()=>{' + code.rstrip() + b"\n})();\n"


def strings_for(templates: tuple[tuple[str, str], ...], language: str) -> Strings:
    """The interface texts of a language: for `pt-BR` its own, then those of `pt`, then English."""
    feature_texts = (feature.texts.items() for feature in features())
    return _strings_for(
        templates, tuple(text for texts in feature_texts for text in texts), language
    )


def words_for(templates: tuple[tuple[str, str], ...], language: str) -> Words:
    """The words by which texts of a language are read: its own, and the English ones.

    Letters with marks may be typed as one character or as two.
    """
    strings, words = strings_for(templates, language), {}
    for field in Words.__struct_fields__:
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
    files = [(path, text) for path, text in templates if path.startswith("strings/")]
    texts = [(path[len("strings/") :].removesuffix(".toml"), text) for path, text in files]
    strings = Strings({}, language)
    for name in dict.fromkeys((DEFAULT_LANGUAGE, language.split("-")[0].lower(), language)):
        for text in (
            text for file_language, text in (*texts, *feature_texts) if file_language == name
        ):
            strings = parse_strings(text, strings, language)
    return strings
