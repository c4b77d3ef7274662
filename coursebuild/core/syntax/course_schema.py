"""What course.toml may hold: its tables and fields; and JSON Schemas of all that authors declare.

The schemas are made from the types by which the decoder reads JSON and TOML.
"""

from __future__ import annotations

import copy
import re
import unicodedata
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta, Struct

from coursebuild.core.drawing.contrast import (
    GROUNDS_DARK,
    GROUNDS_LIGHT,
    REQUIRED_CONTRAST,
    contrast,
    legible,
)
from coursebuild.core.model import Filter, LessonTable, Limits
from coursebuild.core.model.course import PICTURES, FontFamily, Launch, Theme, ThemeFile
from coursebuild.core.model.fields import (
    Author,
    CoursePath,
    Language,
    NotNegative,
    RelativeTolerance,
    Silence,
    Slug,
    Text,
    describe,
    matching,
)
from coursebuild.core.registry import features
from coursebuild.core.syntax.declarations import ModelFile
from coursebuild.core.syntax.nodes import ObjectNode, format_name
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.regex import regex


def _file_field(noun: str, endings: str, example: str) -> Meta:
    return matching(
        rf"^theme(/[\w-][\w.-]*)+\.({endings})$", f"{noun} in `theme/`, as in `theme/{example}`"
    )


Picture: TypeAlias = Annotated[str, _file_field("an SVG or PNG", "svg|png", "logo.svg")]
Png: TypeAlias = Annotated[str, _file_field("a PNG", "png", "icon.png")]
StyleSheet: TypeAlias = Annotated[str, _file_field("a style sheet", "css", "style.css")]
Font: TypeAlias = Annotated[str, _file_field("a font", "ttf|otf|woff2?", "Vollkorn.ttf")]
Licence: TypeAlias = Annotated[str, _file_field("a text", "txt|md", "OFL.txt")]
Colour: TypeAlias = Annotated[str, matching("^#[0-9A-Fa-f]{6}$", "a colour as in `#17487a`")]


class FontTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A typeface of the course's own."""

    use: Annotated[Literal["text", "interface", "code"], describe("what is set in it")]
    files: Annotated[tuple[Font, ...], describe("its styles, upright first", min_length=1)]
    licence: Annotated[Licence, describe("by which it may be published")]


class ThemeTable(Struct, frozen=True, forbid_unknown_fields=True):
    """The face of the site."""

    logo: Annotated[Picture | None, describe("beside the title of every page")] = None
    logo_dark: Annotated[Picture | None, describe("the same on dark pages")] = None
    icon: Annotated[Picture | None, describe("of the browser's tab, square")] = None
    touch_icon: Annotated[
        Png | None, describe("of an installed course, square; 512 pixels are enough")
    ] = None
    accent: Annotated[Colour | None, describe("of links and buttons")] = None
    accent_dark: Annotated[
        Colour | None, describe("the same on dark pages; without it, a lighter `accent`")
    ] = None
    css: Annotated[tuple[StyleSheet, ...], describe("read after the tool's own")] = ()
    font: tuple[FontTable, ...] = ()


def theme(node: ObjectNode, fields: ThemeTable) -> Theme:
    """The theme that the table describes."""

    def file(name: str, path: str | None) -> ThemeFile | None:
        return None if path is None else ThemeFile(path, node.place(name))

    pictures: dict[str, Any] = {name: file(name, getattr(fields, name)) for name in PICTURES}
    return Theme(
        **pictures,
        accent=(fields.accent or "").lower(),
        accent_dark=(fields.accent_dark or "").lower(),
        css=_theme_files(node, "css", fields.css),
        fonts=tuple(
            FontFamily(
                font.use,
                _theme_files(table, "files", font.files),
                ThemeFile(font.licence, table.place("licence")),
            )
            for table, font in zip(node.objects("font"), fields.font, strict=True)
        ),
    )


def check_contrast(node: ObjectNode, theme: Theme) -> Iterator[Diagnostic]:
    """Warn of accents that cannot be read on the grounds of a page."""
    for name, colour, grounds in (
        ("accent", theme.accent, GROUNDS_LIGHT),
        ("accent_dark", theme.accent_dark, GROUNDS_DARK),
    ):
        if colour and (ratio := contrast(colour, grounds)) < REQUIRED_CONTRAST:
            scheme = "light" if grounds is GROUNDS_LIGHT else "dark"
            message = f"on {scheme} pages `{colour}` has a contrast of {ratio:.2f} : 1"
            nearest = legible(colour, grounds)
            help = f"text needs {REQUIRED_CONTRAST} : 1; `{nearest}` is the nearest that reaches it"
            fix = Fix(help, nearest, colour)
            yield diagnose("theme-contrast", node.place(name), message, help=fix)


def _theme_files(node: ObjectNode, name: str, paths: tuple[str, ...]) -> tuple[ThemeFile, ...]:
    return tuple(map(ThemeFile, paths, (item.span for item in node.items(name))))


# --- where notebooks run


_GITHUB = regex(r"https?://(?i:github\.com)/[\w-]+/[\w.-]+/?", re.ASCII)
_NO_BRANCH = regex(r"[\x00-\x20\x7f~^:?*\[\\]|\.\.|//|@\{|(^|/)\.|^[-/]|[./]$|\.lock(/|$)|^@?$")
"""What git-check-ref-format(1) forbids in the name of a branch."""
_SERVICES = ("colab", "binder", "jupyterhub", "codespaces")


def check_launch(node: ObjectNode, fields: Launch, repository: str | None) -> Iterator[Diagnostic]:
    """Check what the types of the table cannot say; `repository` is that of `[course]`."""
    has_service = any(getattr(fields, name) for name in _SERVICES)
    if not has_service and node.members.keys() <= {*Launch.__struct_fields__}:
        message = "`[launch]` names no place to run notebooks"
        help = "set at least one of `colab`, `binder`, `jupyterhub` and `codespaces`"
        yield diagnose("field-missing", node.mark, message, help=help)
    place = fields.repository or repository
    if not place:
        message = "`[launch]` needs `repository`, as `[course]` has none"
        yield diagnose("field-missing", node.mark, message)
    else:
        for name, service in (("colab", "Colab"), ("codespaces", "Codespaces")):
            if getattr(fields, name) and not _GITHUB.fullmatch(place):
                message = f"{service} opens repositories on GitHub only"
                help = "expected: a `repository` as in `https://github.com/owner/name`"
                yield diagnose("field-value", node.place(name), message, help=help)
    if _NO_BRANCH.search(fields.branch):
        message = f"{format_name(fields.branch)} cannot be the name of a branch"
        yield diagnose("field-value", node.place("branch"), message)
    parts = fields.folder.split("/")
    if fields.folder and ({"", ".", ".."} & {*parts} or not fields.folder.isprintable()):
        message = f"{format_name(fields.folder)} is not a folder of a repository"
        help = "expected: its path from the top, as in `docs`"
        yield diagnose("field-value", node.place("folder"), message, help=help)


Url: TypeAlias = Annotated[
    str, matching(r"^https?://[^\s/]\S*$", "an address that begins with `https://` or `http://`")
]
Doi: TypeAlias = Annotated[
    str, matching(r"^10\.\d{4,9}/\S+$", "a DOI without an address, as in `10.5281/zenodo.1234567`")
]
Version: TypeAlias = Annotated[
    str, matching(r"^[0-9]+\.[0-9]+\.[0-9]+$", "a version of three numbers, as in `3.14.0`")
]
Edition: TypeAlias = Annotated[
    str, matching(r"^[0-9][0-9A-Za-z.+-]*$", "a version, as in `2026` or `1.2.0`")
]
FeaturePath: TypeAlias = Annotated[
    str,
    matching(
        r"^features/[\w-]+(/[\w-]+)*\.py$", "a Python file in `features/`, as in `features/tabs.py`"
    ),
]
FolderPath: TypeAlias = Annotated[
    str, matching(r"^[\w-]+(/[\w-]+)*$", "a folder of the course, as in `src`")
]
InterpreterPath: TypeAlias = Annotated[
    str,
    matching(
        r"^([\w.-]+/)+bin/python[0-9.]*$",
        "the Python of a virtual environment, as in `.venv/bin/python`",
    ),
]


_LETTERS = str.maketrans({"æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d", "ı": "i"})


def slug_of(text: str) -> str:
    """A name for files and addresses: lower-case words of ASCII joined by hyphens."""
    text = text.casefold().translate(_LETTERS)  # ß is ss then
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return "-".join(re.findall("[a-z0-9]+", plain)) or "untitled"


class CourseTable(Struct, frozen=True, forbid_unknown_fields=True):
    """What the course is."""

    title: Annotated[Text, describe("plain text")]
    id: Annotated[
        Slug | None, describe("what readers' progress is kept under; without it, the title")
    ] = None
    summary: Annotated[
        str, describe("one or two sentences, for the home page and search engines")
    ] = ""
    language: Annotated[
        Language, describe("the language of the lessons and the interface, as in `en` or `pt-BR`")
    ] = "en"
    base_url: Annotated[
        Url | None, describe("where the site will stand: for the sitemap and the 404 page")
    ] = None
    repository: Annotated[
        Url | None, describe("where its sources are: pages get a link to edit their file")
    ] = None
    licence: Annotated[str, describe("its name, as in `CC-BY-4.0`, shown in the footer")] = ""
    authors: Annotated[
        tuple[Author, ...], describe("who wrote it, in the order in which they are cited")
    ] = ()
    doi: Annotated[Doi | None, describe("its DOI, by which it is cited")] = None
    version: Annotated[
        Edition | None,
        describe("of the course, as in `2026` or `1.2.0`: shown in the head of each page"),
    ] = None
    engine: Annotated[
        Version | None,
        describe("the version of MuJoCo that the course needs; another one is an error"),
    ] = None
    features: Annotated[
        tuple[FeaturePath, ...], describe("features of the course's own, as files in `features/`")
    ] = ()
    folds: Annotated[
        Literal["open", "closed"],
        describe("whether folded parts are printed in full, in `export page` and `pdf`"),
    ] = "open"
    packages: Annotated[
        tuple[FolderPath, ...],
        describe("folders that scripts import from, before installed packages, as in `src`"),
    ] = ()


class VerifyTable(Struct, frozen=True, forbid_unknown_fields=True):
    """How recorded outputs are compared where a fence says nothing."""

    compare: Annotated[
        Literal["exact", "digits", "rtol"] | None,
        describe("the same text, the same digits, or within rtol and atol; else exact"),
    ] = None
    rtol: Annotated[
        RelativeTolerance | None, describe("tolerance relative to the recorded number")
    ] = None
    atol: Annotated[NotNegative | None, describe("absolute tolerance")] = None
    ellipsis: Annotated[bool, describe("`...` in a recorded output matches anything")] = False
    filter: tuple[Filter, ...] = ()
    env: Annotated[dict[str, str], describe("environment variables of scripts")] = {}
    python: Annotated[
        InterpreterPath | None, describe("what runs the scripts, relative to the course's folder")
    ] = None
    strict: Annotated[bool, describe("warnings are errors, as with `--strict`")] = False
    unproven: Annotated[
        tuple[Text, ...],
        describe("paths of scripts that `strict` lets pass where they are not run"),
    ] = ()
    names: Annotated[
        tuple[Text, ...], describe("inline code that names nothing; `*` and `?` stand for anything")
    ] = ()


class FormatTable(Struct, frozen=True, forbid_unknown_fields=True):
    """How `coursebuild fmt` lays lessons out."""

    width: Annotated[
        int,
        describe("columns of a line of text; 0 leaves line breaks where they are", ge=0, le=1000),
    ] = 0


class CalloutTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A kind of callout."""

    label: Annotated[Text, describe("shown over the callout")]
    promise: Annotated[str, describe("what it promises the reader")] = ""


class LevelTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A level: a group of lessons."""

    id: Annotated[
        Annotated[str, matching(r"^[A-Za-z0-9]+$", "letters and digits, as in `4` or `A`")]
        | Annotated[int, Meta(ge=0)],
        describe("letters and digits, as in `4` or `A`"),
    ]
    title: Annotated[Text, describe("plain text")]
    summary: Annotated[str, describe("one sentence, for the course map")] = ""
    lesson: tuple[LessonTable, ...] = ()


class PageTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A page that is no lesson."""

    id: Annotated[Slug, describe("the page's name in links and in its address")]
    title: Annotated[Text, describe("plain text")]
    file: Annotated[Text, describe("its Markdown file, anywhere in the project")]
    section: Annotated[
        str,
        describe(
            "the heading under which it stands in a list of pages beside it; "
            "without one it has no such list"
        ),
    ] = ""
    menu: Annotated[bool, describe("whether it is in the menu of every page")] = True
    names: Annotated[bool, describe("whether names in its code have to be known")] = True
    language: Annotated[Language | None, describe("its language, if not the course's")] = None


class SecurityTable(Struct, frozen=True, forbid_unknown_fields=True):
    """How far those who write the course are trusted."""

    html: Annotated[
        Literal["none", "safe", "trusted"],
        describe(
            "raw HTML in texts: none, none that runs or loads anything, or any at all; "
            "then any SVG file, too"
        ),
    ] = "safe"


Command: TypeAlias = Annotated[tuple[Text, ...], Meta(min_length=1)]
"""A program and its arguments."""


class CourseFile(Struct, frozen=True, forbid_unknown_fields=True):
    """The course map: the whole syllabus, and how the course is built."""

    course: CourseTable
    theme: ThemeTable | None = None
    verify: VerifyTable | None = None
    format: FormatTable | None = None
    security: SecurityTable = SecurityTable()
    limits: Limits = Limits()
    launch: Launch | None = None
    callouts: Annotated[
        dict[str, Text | CalloutTable],
        describe("more kinds of callouts by name, with a label or a table"),
    ] = {}
    macros: Annotated[
        dict[str, str],
        describe("commands of formulas by name, with what they stand for; `#1` is an argument"),
    ] = {}
    runners: Annotated[
        dict[str, Annotated[tuple[Command, ...], Meta(min_length=1)]],
        describe("by the kind of a fence, the commands that run scripts in another language"),
    ] = {}
    silence: tuple[Silence, ...] = ()
    level: tuple[LevelTable, ...] = ()
    path: tuple[CoursePath, ...] = ()
    page: tuple[PageTable, ...] = ()


# --- JSON Schemas

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_ROOTS: dict[str, tuple[type[Struct], str]] = {
    "course": (CourseFile, "The course map, content/course.toml"),
    "model": (ModelFile, "The file beside a model, models/NAME.toml"),
}


def schema_roots() -> dict[str, tuple[type[Struct], str]]:
    """The declared type and the title of each schema, by name."""
    return _ROOTS | {name: root for feature in features() for name, root in feature.schemas.items()}


def json_schema(name: str) -> bytes:
    """The JSON Schema (draft 2020-12), indented, keys in a fixed order, with a final newline."""
    root, title = schema_roots()[name]
    schema = copy.deepcopy(msgspec.json.schema(root))
    definitions: dict[str, Any] = schema["$defs"]
    if name == "course":
        definitions["Silence"]["required"].append("reason")
    for refine in (feature.refine_schema for feature in features()):
        if refine is not None:
            refine(definitions)
    schema = {
        "$schema": DIALECT,
        "title": title,
        "$ref": schema["$ref"],
        "$defs": dict(sorted(definitions.items())),
    }
    return msgspec.json.format(msgspec.json.encode(schema), indent=2) + b"\n"
