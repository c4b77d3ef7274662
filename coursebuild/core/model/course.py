"""The course: its vocabulary, its map and its look, its lessons and pages, its models."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct
from msgspec.structs import replace

from coursebuild.core.model import fields
from coursebuild.core.model.blocks import Comparison, Document, Filter, Paragraph, Recording
from coursebuild.core.model.fields import (
    Author,
    CoursePath,
    Silence,
    Slug,
    WebPlace,
    describe,
    matching,
)
from coursebuild.core.model.inlines import NumberBinding
from coursebuild.core.model.lesson_record import LessonRecord
from coursebuild.core.model.scenarios import Declarations
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Source, Span, key_of

CALLOUTS: tuple[str, ...] = tuple(
    """
    established derivation implementation recommendation research unverified version warning
    try solution note tip important caution theorem lemma definition algorithm exercise
    """.split()
)
"""Their labels and promises are interface texts, `callout.NAME` and `promise.NAME`."""


class Words(Struct, frozen=True):
    """The words by which a text is read: of captions, of mentions as in "Lesson 4.3", of formulas.

    Of a text in another language they are the interface texts `words.…`, then the English ones.
    """

    output: tuple[str, ...] = ("Output",)
    figure: tuple[str, ...] = ("Figure",)
    table: tuple[str, ...] = ("Table",)
    lesson: tuple[str, ...] = ("Lesson",)
    lessons: tuple[str, ...] = ("Lessons",)
    level: tuple[str, ...] = ("Level",)
    levels: tuple[str, ...] = ("Levels",)
    conjunctions: tuple[str, ...] = ("and", "or", "to")
    """Between the numbers of lessons or levels."""
    decimal: tuple[str, ...] = (".",)
    """The signs before the decimals of a number; the first is shown."""
    range: tuple[str, ...] = ("to",)
    """Those of them that stand for all numbers between."""
    macros: tuple[tuple[str, str], ...] = ()
    """The course's commands of formulas, each with what it stands for; in every language."""


ENGLISH = Words()


# --- the course


class ThemeFile(Struct, frozen=True):
    """A file in `theme/` that the map names."""

    path: str
    span: Span
    data: bytes = b""
    """Empty until it has been read."""

    @property
    def ending(self) -> str:
        return self.path.rpartition(".")[2]

    @property
    def text(self) -> str:
        return self.data.decode("utf-8", "replace")


class FontFamily(Struct, frozen=True):
    """A typeface, and what it is used for."""

    use: Literal["text", "interface", "code"]
    files: tuple[ThemeFile, ...]
    licence: ThemeFile


class Theme(Struct, frozen=True):
    """Logo, icons, colours, style sheets, fonts and templates; empty ones are the tool's own."""

    logo: ThemeFile | None = None
    logo_dark: ThemeFile | None = None
    icon: ThemeFile | None = None
    touch_icon: ThemeFile | None = None
    accent: str = ""
    accent_dark: str = ""
    css: tuple[ThemeFile, ...] = ()
    fonts: tuple[FontFamily, ...] = ()
    templates: tuple[Source, ...] = ()
    """The files of `theme/templates/`, each replacing the template of that name."""

    @property
    def pictures(self) -> tuple[ThemeFile, ...]:
        fields = (getattr(self, name) for name in PICTURES)
        return tuple(file for file in fields if file is not None)

    @property
    def template_texts(self) -> tuple[tuple[str, str], ...]:
        return tuple(
            (source.path.removeprefix(TEMPLATES), source.text) for source in self.templates
        )


PICTURES = ("logo", "logo_dark", "icon", "touch_icon")
TEMPLATES = "theme/templates/"


_COMMENT = regex("<!--(.*?)-->", re.DOTALL)
_LICENCE = regex("copyright|licen[cs]e", re.IGNORECASE)

LessonId: TypeAlias = Annotated[
    str,
    matching(
        r"^[A-Za-z0-9]+(\.[A-Za-z0-9]+)+$",
        "letters and digits in parts joined by dots, as in `4.2` or `A.1`",
    ),
]


class LessonTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A lesson, written or planned."""

    id: Annotated[LessonId, describe("its level's id, a dot and its own part")]
    slug: Annotated[Slug, describe("with the id, the name of its file and page")]
    title: Annotated[fields.Text, describe("plain text")]
    status: Annotated[
        Literal["complete", "draft", "planned"], describe("a planned lesson has no file yet")
    ]
    summary: Annotated[str, describe("one sentence, for the course map")] = ""
    aliases: Annotated[
        tuple[fields.Text, ...], describe("other names, by which the search finds it")
    ] = ()
    objectives: Annotated[
        tuple[fields.Text, ...], describe("what a learner can do afterwards")
    ] = ()
    prerequisites: Annotated[
        tuple[fields.Text, ...], describe("ids of lessons to read first; circles are errors")
    ] = ()
    minutes: Annotated[
        Annotated[int, Meta(ge=1, le=100_000)] | None,
        describe("the time to read it and work through it, without what goes further"),
    ] = None
    further: Annotated[
        Annotated[int, Meta(ge=1, le=100_000)] | None,
        describe("minutes of the sections marked `{.further}`"),
    ] = None
    language: Annotated[fields.Language | None, describe("its language, if not the course's")] = (
        None
    )


class Lesson(LessonTable, frozen=True, kw_only=True):
    """A lesson of the map; `document` is `None` for a planned one."""

    span: Span
    prerequisite_spans: tuple[Span, ...]
    level: str
    document: Document | None

    @property
    def path(self) -> str:
        return f"content/lessons/{self.id}-{self.slug}.md"


class Level(Struct, frozen=True):
    """A level of the map."""

    span: Span
    id: str
    title: str
    summary: str
    lessons: tuple[Lesson, ...]


BIBLIOGRAPHY, CITATION_STYLE = "content/references.bib", "content/references.csl"


class Page(Struct, frozen=True):
    """A page that is not a lesson."""

    span: Span
    id: str
    title: str
    path: str
    document: Document | None
    menu: bool = True
    names: bool = True
    """Whether names in its inline code have to be known."""
    section: str = ""
    """The heading under which it stands among the pages; empty where it is in no list."""
    language: str | None = None

    @property
    def is_home(self) -> bool:
        """Whether its text opens the home page, instead of a page of its own."""
        return self.id == "home"


Owner: TypeAlias = Lesson | Page


class MjcfModel(Struct, frozen=True):
    """A file of `models/`; its name is its path there without `.xml`."""

    name: str
    source: Source

    @property
    def description(self) -> str:
        """The first comment above the model that is no licence, on one line."""
        head = self.source.text.partition("<mujoco")[0]
        comments = (" ".join(text.split()) for text in _COMMENT.findall(head))
        return next((text for text in comments if not _LICENCE.search(text)), "")


class CalloutKind(Struct, frozen=True):
    """A kind of callout; a label or promise that is empty is that of the interface texts."""

    name: str
    label: str = ""
    promise: str = ""


class NamedPath(Struct, frozen=True):
    """A file or folder that the map names."""

    path: str
    span: Span


class Launch(Struct, frozen=True, forbid_unknown_fields=True):
    """Where readers can run the notebooks of lessons, which lie in a repository of the site."""

    repository: Annotated[
        WebPlace | None, describe("with the built site; without it, that of `[course]`")
    ] = None
    branch: Annotated[fields.Text, describe("the branch with the built site")] = "gh-pages"
    folder: Annotated[
        str, describe("the folder of the built site in it, as in `docs`; else the top")
    ] = ""
    colab: Annotated[bool, describe("a button for Google Colab; needs GitHub")] = False
    binder: Annotated[
        WebPlace | None, describe("a button for this Binder, as in `https://mybinder.org`")
    ] = None
    jupyterhub: Annotated[
        WebPlace | None, describe("a button for this JupyterHub, which needs nbgitpuller")
    ] = None
    codespaces: Annotated[bool, describe("a button for GitHub Codespaces")] = False


class Limits(Struct, frozen=True, forbid_unknown_fields=True):
    """How much reading and trying the course may take."""

    text: Annotated[
        int, describe("characters of a lesson, page or model", ge=1, le=100_000_000)
    ] = 250_000
    scripts: Annotated[int, describe("MiB that a script may take", ge=1, le=1 << 20)] = 16_384
    memory: Annotated[
        int, describe("MiB for compiling a model, and for trying a lab", ge=1, le=1 << 20)
    ] = 896
    models: Annotated[
        float,
        describe(
            "seconds of processor time for compiling all models; one may take half",
            gt=0,
            le=100_000,
        ),
    ] = 8.0
    lab: Annotated[
        float, describe("seconds of processor time for trying one lab", gt=0, le=100_000)
    ] = 8.0


class Course(Struct, frozen=True):
    """A whole course."""

    map: Source
    title: str
    summary: str
    language: str
    base_url: str
    repository: str
    licence: str
    engine: str | None
    engine_span: Span
    comparison: Comparison
    filters: tuple[Filter, ...]
    callouts: tuple[CalloutKind, ...]
    silences: tuple[Silence, ...]
    levels: tuple[Level, ...]
    pages: tuple[Page, ...]
    models: tuple[MjcfModel, ...]
    paths: tuple[CoursePath, ...] = ()
    """Ways through it, which the home page shows."""
    files: tuple[str, ...] = ()
    """Other files in `content/` that a page may show or link to (pictures, data), by path relative
    to the root."""
    pictures: Mapping[str, tuple[int, int]] = {}
    """Width and height of those that documents show, in CSS pixels, by path; not where unknown."""
    declarations: tuple[Declarations, ...] = ()
    """The contents of the files `models/NAME.toml`, of existing models only."""
    bound_numbers: tuple[NumberBinding, ...] = ()
    """Those of the map's texts."""
    records: Mapping[str, LessonRecord] = {}
    """What lessons and pages were recorded with, by their paths."""
    features: tuple[NamedPath, ...] = ()
    packages: tuple[NamedPath, ...] = ()
    """Folders that scripts import from, after their own and before all others."""
    environment: tuple[tuple[str, str], ...] = ()
    """Variables of scripts, sorted."""
    runners: Mapping[str, tuple[tuple[str, ...], ...]] = {}
    """The commands that run scripts in other languages, by the kinds of their fences."""
    macros: Mapping[str, Excerpt] = {}
    """What the course's own commands of formulas stand for, by their names."""
    python: NamedPath | None = None
    """The interpreter of the scripts, if not the one that runs this tool."""
    strict: bool = False
    unproven: tuple[NamedPath, ...] = ()
    """The scripts that need not have been run where warnings count as errors."""
    names: tuple[str, ...] = ()
    """Inline code that names nothing which is known; `*` and `?` stand for anything."""
    references: Mapping[str, Struct] = {}
    """What features read of the scripts' environment (`Feature.reference`), by their names."""
    id: str = ""
    """A name for the course that stays when its title changes; see `key`."""
    width: int = 0
    """The columns to which `fmt` wraps text; 0 leaves the author's lines."""
    html: Literal["none", "safe", "trusted"] = "safe"
    folds: Literal["open", "closed"] = "open"
    """Whether what authors fold is printed in full."""
    limits: Limits = Limits()
    launch: Launch | None = None
    """Where notebooks can be run; its `repository` is set."""
    theme: Theme = Theme()
    words: Mapping[str, Words] = {}
    """By language: of the course, and of the lessons and pages in others."""
    authors: tuple[Author, ...] = ()
    doi: str = ""
    version: str = ""
    """Of the course, the name of a folder; sites of several may stand beside each other."""
    bibliography: Source | None = None
    """The list of sources, `BIBLIOGRAPHY`."""
    citation_style: Source | None = None
    """The course's own style for them, `CITATION_STYLE`."""

    @property
    def key(self) -> str:
        """The key of progress in readers' browsers: the id, or a text made from the title."""
        words = re.findall(r"[a-z0-9]+", self.title.lower())
        return self.id or "-".join((*words, key_of(self.title)[:8]))

    def comparison_of(self, recording: Recording) -> Comparison:
        """How a recorded output is compared."""
        comparison = recording.comparison or self.comparison
        return replace(comparison, course_filters=self.filters)

    def language_of(self, owner: Owner | None) -> str:
        """The language of a lesson or page, or of the course's own texts."""
        return (owner.language if owner is not None else "") or self.language

    def words_of(self, owner: Owner | None) -> Words:
        """The words by which a text is read; one that the map does not name is as the course."""
        words = self.words.get(self.language_of(owner), ENGLISH)
        return replace(words, macros=tuple((name, tex.text) for name, tex in self.macros.items()))

    @property
    def callout_names(self) -> frozenset[str]:
        return frozenset(kind.name for kind in self.callouts)

    @property
    def lessons(self) -> tuple[Lesson, ...]:
        return tuple(lesson for level in self.levels for lesson in level.lessons)

    @property
    def is_manual(self) -> bool:
        """Whether it is made of pages alone, in sections."""
        return not self.lessons and any(page.section for page in self.pages)

    @property
    def written_levels(self) -> tuple[Level, ...]:
        """The levels with their written lessons alone, but for levels without any."""
        levels = (
            replace(level, lessons=tuple(x for x in level.lessons if x.document is not None))
            for level in self.levels
        )
        return tuple(level for level in levels if level.lessons)

    @property
    def written_lessons(self) -> tuple[Lesson, ...]:
        return tuple(lesson for lesson in self.lessons if lesson.document is not None)

    @property
    def owners(self) -> tuple[Owner, ...]:
        """Everything that may have a document: lessons, then pages."""
        return (*self.lessons, *self.pages)

    @property
    def owned_documents(self) -> tuple[tuple[Owner, Document], ...]:
        return tuple((o, o.document) for o in self.owners if o.document is not None)

    @property
    def documents(self) -> tuple[Document, ...]:
        """Every parsed document: lessons, then pages."""
        return tuple(document for _, document in self.owned_documents)

    @property
    def shown_texts(self) -> tuple[tuple[str, Document], ...]:
        """Every text that shows what scripts print, with the id of its lesson or page."""
        texts = [(owner.id, document) for owner, document in self.owned_documents]
        if numbers := tuple(map(self._in_its_language, self.bound_numbers)):
            texts.append(("", Document(self.map, (Paragraph(self.map.span(), numbers),), ())))
        return tuple(texts)

    def _in_its_language(self, number: NumberBinding) -> NumberBinding:
        """A number of the map, with the decimal sign of the lesson of which it is said."""
        owner = next((o for o in self.owners if o.span.contains(number.span)), None)
        return replace(number, comma="," in self.words_of(owner).decimal)

    @property
    def sources(self) -> tuple[Source, ...]:
        """Every text: the map, the documents, the models and their declarations."""
        holders: tuple[Document | MjcfModel | Declarations, ...]
        holders = (*self.documents, *self.models, *self.declarations)
        lists = filter(None, (self.bibliography, self.citation_style))
        return (self.map, *(holder.source for holder in holders), *lists)
