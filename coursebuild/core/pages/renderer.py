"""The renderer of pages: interface texts, templates in Jinja's language, formulas.

Of interface texts there is a file for each language:

1. A file is TOML: tables of texts, addressed by dotted path. `{name}` in a text is replaced by a
   value.
2. A text that depends on a number is a table with the plural forms of its language, `other` among
   them; the value `n` selects one. The forms are the categories of CLDR 48 for whole numbers:
   https://www.unicode.org/cldr/charts/48/supplemental/language_plural_rules.html
3. A key missing in a language is taken from English; one missing in English is a programming error
   (`KeyError`). All forms of a text are of one language.

The direction in which a language is written is that of the script that its tag names (`az-Arab`),
if any; else of the region, where that writes it in another script than others (`pa-PK`). Sources:
the Unicode Standard (chapters 9, 10, 14 and 19), and the likely scripts of languages in CLDR.

Templates that the tool was bundled with are loaded as the Python they were compiled to then; those
of a source tree are compiled on use. A course may replace templates by its own. Errors in these are
its author's, and are reported with their place.
"""

from __future__ import annotations

import functools
import hashlib
import re
import traceback
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Literal, TypeAlias

from jinja2 import (
    BaseLoader,
    ChoiceLoader,
    DictLoader,
    Environment,
    FunctionLoader,
    ModuleLoader,
    StrictUndefined,
    TemplateSyntaxError,
)
from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.model.course import TEMPLATES
from coursebuild.core.model.results import Formula, MathError, Mathml
from coursebuild.core.pages.typography import split_quantities, text_html
from coursebuild.core.text.regex import regex

DEFAULT_LANGUAGE = "en"
Category: TypeAlias = Literal["zero", "one", "two", "few", "many", "other"]

CATEGORIES: tuple[Category, ...] = ("zero", "one", "two", "few", "many", "other")
"""All categories; every language has the last."""


_REPORT = "report."
_BETWEEN_SENTENCES = regex(r"((?<=\.) | · |; | / )")
_MEASURE = regex(r"[-\u2212]?[0-9]+(?:\.[0-9]+)?(?:[e·]\S+)?(?: ± [0-9.]+ %)?(?: [^\s.]{1,5})?")
_AUTHORS = ("name", "title")
"""Parts of a text of a report that an author has written."""


class Strings(Struct, frozen=True, dict=True):
    """The interface texts in one language."""

    texts: Mapping[str, str]
    language: str = DEFAULT_LANGUAGE

    def __call__(self, key: str, **values: str | int | float) -> str:
        """The text of a key, with values inserted; numbers as the language writes them."""
        text = self.texts.get(key)
        if text is None and "n" in values:
            n = values["n"]
            form = "other" if isinstance(n, str) else category(self.language, n)
            text = self.texts.get(f"{key}.{form}", self.texts.get(f"{key}.other"))
        if text is None:
            raise KeyError(f"no interface text {key!r}")
        texts = {k: self.number(v) if isinstance(v, float) else v for k, v in values.items()}
        return self.isolate(text.format_map(texts)) if values else text

    def isolate(self, text: str) -> str:
        """A text whose quantities keep their direction among letters from right to left."""
        if direction(self.language) == "ltr":
            return text
        return "".join(
            f"\u2066{q}\u2069" if isolated else q for q, isolated in split_quantities(text)
        )

    def translate(self, text: str) -> str:
        """What mjbench's reports say in English, in this language.

        The key of a text is its English, with the names of parts that are translated on their own.
        A text without a key stays as it is, but for the decimal sign of a measured figure.
        """
        return self.isolate(self._translate(text))

    def _translate(self, text: str) -> str:
        if self.has(_REPORT + text):
            return self.texts[_REPORT + text]
        parts = _BETWEEN_SENTENCES.split(text)
        if len(parts) > 1:
            pairs = enumerate(parts)
            return "".join(part if n % 2 else self._translate(part) for n, part in pairs)
        for pattern, translation in self._report_patterns:
            if (match := pattern.fullmatch(text)) is not None:
                values = {
                    name: value if name in _AUTHORS else self._translate(value)
                    for name, value in match.groupdict().items()
                }
                return translation.format(**values)
        if ", " in text:
            return self.join(map(self._translate, text.split(", ")))
        return self.decimals(text) if _MEASURE.fullmatch(text) else text

    @functools.cached_property
    def _report_patterns(self) -> list[tuple[re.Pattern[str], str]]:
        """The patterns of texts with parts, those with more words of their own first."""
        patterns: list[tuple[int, re.Pattern[str], str]] = []
        for key, text in self.texts.items():
            english = key.removeprefix(_REPORT)
            if english not in (key, text) and "{" in english:
                words = re.sub(r"\{\w+\}", "", english)
                groups = re.sub(r"\\{(\w+)\\}", r"(?P<\1>.+?)", re.escape(english))
                groups = groups.replace("(?P<n>.+?)", "(?P<n>[0-9][0-9.]*)")
                patterns.append((len(words), re.compile(groups), text))
        patterns.sort(key=lambda pattern: -pattern[0])
        return [(pattern, text) for _, pattern, text in patterns]

    def prefer(self, prefix: str) -> Strings:
        """The texts in which one of the key `prefix` + KEY replaces that of KEY."""
        preferred = {
            k.removeprefix(prefix): t for k, t in self.texts.items() if k.startswith(prefix)
        }
        return Strings(dict(sorted((dict(self.texts) | preferred).items())), self.language)

    def join(self, items: Iterable[str]) -> str:
        """The items one after the other, with the comma of the language between them."""
        return f"{self('site.comma')} ".join(items)

    def number(self, value: float, digits: int | None = None) -> str:
        """A number as people write it: no trailing zeros, a real minus, the decimal sign."""
        text = f"{value:.{digits}f}" if digits is not None else f"{value:.12g}"
        return self.decimals(text.replace("-", "\u2212"))

    def decimals(self, number: str) -> str:
        """A number, or markup of one, with the language's sign before its decimals."""
        return number.replace(".", self("words.decimal")[0])

    def has(self, key: str) -> bool:
        """Whether there is a text of this key."""
        return key in self.texts


def parse_strings(
    text: str, fallback: Strings | None = None, language: str = DEFAULT_LANGUAGE
) -> Strings:
    """Read a file of texts; what it lacks comes from `fallback`."""
    import tomllib

    texts = dict(_flatten(tomllib.loads(text), ""))
    table = dict(fallback.texts) if fallback is not None else {}
    for key in texts:
        stem, _, form = key.rpartition(".")
        if form in CATEGORIES and f"{stem}.other" in texts:
            for other_form in CATEGORIES:
                table.pop(f"{stem}.{other_form}", None)
    table.update(texts)
    return Strings(dict(sorted(table.items())), language)


def _flatten(table: dict[str, object], prefix: str) -> Iterator[tuple[str, str]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{name}.")
        elif isinstance(value, str):
            yield prefix + name, value
        else:
            raise TypeError(f"interface text {prefix + name!r} is not a text")


def category(language: str, n: float) -> Category:
    """The plural form that goes with a number; a language without texts follows English."""
    if n != int(n):
        return "other"
    n = abs(int(n))
    match language.replace("_", "-").split("-")[0].lower():
        case "ar":
            if n <= 2:
                return CATEGORIES[n]
            if 3 <= n % 100 <= 10:
                return "few"
            return "many" if n % 100 >= 11 else "other"
        case "fr" | "es" if n and n % 1_000_000 == 0:
            return "many"
        case "fr":
            return "one" if n <= 1 else "other"
        case _:
            return "one" if n == 1 else "other"


_FROM_THE_RIGHT = frozenset(
    "adlm arab aran armi avst chrs cprt elym gara hatr hebr hung khar lydi mand mani mend merc mero"
    " narb nbat nkoo orkh ougr palm phli phlp phnx prti rohg samr sarb sogd sogo syrc syre syrj"
    " syrn thaa todr yezi".split()
)

_LANGUAGES = frozenset(
    # of Arabic script
    "aeb afb ajp apc apd ar ara arb arq ars ary arz ayl bal bcc bej bft bgn bqi brh ckb fa fas fia"
    " gbz gju gjk glk haz hnd hno khw kvx kxp ks lah lki lrc luz mvy mzn pbt pbu per pes phl phr"
    " pnb prs ps pst pus rmt sd sdh shu skr snd swb trw tda ug uig ur urd wni xpr zdj azb"
    " acm acq ajt aao"
    # of Hebrew
    " he heb iw yi yid ji jpr jrb sam"
    # of others
    " arc aii syr syc tru dv div nqo rhg".split()
)
"""Languages that are written from the right unless their tag names a script."""

_REGIONS = {
    "az": "ir iq",
    "ha": "sd",
    "kk": "af cn ir mn",
    "ku": "iq ir lb",
    "ky": "cn",
    "ms": "cc",
    "pa": "pk",
    "tk": "af ir",
    "tt": "cn",
    "uz": "af cn",
}
"""Regions that write a language from the right, though others do not."""


@functools.lru_cache(maxsize=16)
def direction(language: str) -> Literal["ltr", "rtl"]:
    """The direction of the text of a language, by its tag (`ar`, `uz-Arab-AF`)."""
    name, *rest = re.split(r"[-_]", language.lower())
    script, region = "", ""
    for part in rest:
        if len(part) == 1:  # an extension begins: nothing after it names a script
            break
        if len(part) == 4 and part.isalpha() and not script:
            script = part
        elif len(part) == 2:
            region = part
    if script:
        return "rtl" if script in _FROM_THE_RIGHT else "ltr"
    from_the_right = name in _LANGUAGES or region in _REGIONS.get(name, "").split()
    return "rtl" if from_the_right else "ltr"


# --- templates

Texts: TypeAlias = tuple[tuple[str, str], ...]
"""Files of `templates/` by path."""


@functools.lru_cache(maxsize=8)
def templates_of(
    texts: Texts, folder: Path | None = None, course_templates: Texts = ()
) -> Environment:
    """The templates among the tool's files, or compiled in `folder`, after those of the course."""
    compiled_folder = None if folder is None else folder / compiled_name(texts)
    loaders: list[BaseLoader] = [DictLoader(_pages(texts))]
    if compiled_folder is not None and compiled_folder.is_dir():
        loaders = [ModuleLoader(compiled_folder)]
    if course_templates:
        sources = {name: (text, f"{TEMPLATES}{name}", None) for name, text in course_templates}
        loaders = [FunctionLoader(sources.get), *loaders]
    return _environment(ChoiceLoader(loaders))


class TemplateFailure(Exception):  # noqa: N818
    """An error in a template of the course: path, line and message."""

    def __init__(self, path: str, line: int, message: str) -> None:
        super().__init__(path, line, message)
        self.path, self.line, self.message = path, line, message

    @classmethod
    def of(cls, error: Exception) -> TemplateFailure | None:
        """The failure for an exception, if that was raised in a template of the course."""
        if isinstance(error, TemplateFailure):
            return error
        for frame, line in reversed(tuple(traceback.walk_tb(error.__traceback__))):
            path = frame.f_code.co_filename
            if path.startswith(TEMPLATES):
                return cls(path, line, str(error) or type(error).__name__)
        return None


def find_template_error(text: str) -> tuple[int, str] | None:
    """The line and message of the first syntax error in a template; `None` if it is valid."""
    try:
        _environment(DictLoader({})).from_string(text)
    except TemplateSyntaxError as error:
        return error.lineno, error.message or "it is not a template"
    return None


def compile_templates(texts: Texts, folder: Path) -> None:
    """Compile templates into a folder, for `templates_of` to load."""
    environment = _environment(DictLoader(_pages(texts)))
    target = folder / compiled_name(texts)
    environment.compile_templates(target, zip=None, ignore_errors=False)


def compiled_name(texts: Texts) -> str:
    """The name of the folder of these templates, compiled."""
    digest = hashlib.sha256(repr(sorted(_pages(texts).items())).encode())
    return f"templates-{digest.hexdigest()[:16]}"


def _pages(texts: Texts) -> dict[str, str]:
    return {name: text for name, text in texts if name.endswith(".html")}


def _environment(loader: BaseLoader) -> Environment:
    return Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,
    )


def known_mathml(formulas: Mapping[Formula, str | MathError]) -> Mathml:
    """A function that returns formulas as MathML, empty for those with an error."""

    def mathml(tex: str, display: bool) -> str:
        html = formulas.get(Formula(tex, display))
        return html if isinstance(html, str) else ""

    return mathml


class Renderer(Struct, frozen=True):
    """The interface texts in the course's language, the templates, and formulas as MathML."""

    words: Strings
    templates: Environment
    formulas: Mapping[Formula, str | MathError] = field(default_factory=dict)

    def render(self, template: str, **values: object) -> Markup:
        """A filled-in template, without its last line end.

        It can use `t`, the interface texts, and `authored`, see `text`.
        """
        variables = {"t": self.words, "authored": self.text, **values}
        try:
            return Markup(self.templates.get_template(template).render(variables).rstrip("\n"))
        except Exception as error:
            if (failure := TemplateFailure.of(error)) is not None:
                raise failure from error
            raise

    def text(self, text: str) -> Markup:
        """An author's plain text, with numbers joined to their units."""
        return text_html(text, direction(self.words.language))

    def highlight(self, language: str, code: str) -> Markup:
        """Code with its syntax highlighted."""
        # The package is built, its templates compiled, where no highlighter is installed.
        from coursebuild.core.pages.listings import highlight_lines

        return Markup("\n".join(highlight_lines(language, code)))

    def mathml(self, tex: str, display: bool) -> Markup:
        """A formula's MathML; its TeX where that does not parse, which a preview shows."""
        html = self.formulas.get(Formula(tex, display))
        if not isinstance(html, str):
            return Markup('<code class="tex" dir="ltr">{}</code>').format(tex)
        return Markup(html)
