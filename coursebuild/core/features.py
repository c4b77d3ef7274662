"""The interface of features: how kinds of fences and pages, files of a site and exports enter.

Entry point: `Feature`, with `FenceKind`, `PageKind`, `ModelPart`, `PagePart`, `PageCopy`,
`Trials`, `Exporter` and `Command`, which say what a feature has.

A feature is a module with a `FEATURE`. It is found in `coursebuild.features`, under the entry
points `coursebuild.features` of any installed package, or in a file that the course map names
(`features = ["features/NAME.py"]`; see `registry.use_course_features`). All three are alike.
docs/how-to/features.md says how to write one.

What the core asks of a block after it was parsed are the methods of `FeatureBlock`
(`core.model`), so that a checked course can be looked at without its features being loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, NewType, Protocol, TypeAlias, TypeVar

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Block, Course, Document, FeatureBlock, Inline, MjcfModel, Target
from coursebuild.core.model.results import (
    CompileResult,
    FileList,
    ModelFacts,
    OutputFile,
    Results,
    ScriptRun,
    SiteFile,
    TrialResult,
)
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.rules import Rule

if TYPE_CHECKING:  # the layers above, of which a feature's functions take values
    from coursebuild.core.pages.added_files import ExportContext, SiteContext
    from coursebuild.core.pages.assets import Assets
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.library import Library
    from coursebuild.core.pages.page_inputs import PageInputs
    from coursebuild.core.pages.renderer import Renderer
    from coursebuild.core.pages.urls import Place
    from coursebuild.core.run.dependencies import Inputs
    from coursebuild.core.run.memory import Memory
    from coursebuild.core.syntax.fence import Fence
    from coursebuild.core.syntax.texts import TextParser
else:  # names alone, which `help` can show: nothing above is imported
    for above in (
        "Assets",
        "ExportContext",
        "Fence",
        "Inputs",
        "Library",
        "Memory",
        "PageContext",
        "PageInputs",
        "Place",
        "Renderer",
        "SiteContext",
        "TextParser",
    ):
        globals()[above] = NewType(above, object)

B = TypeVar("B", bound=FeatureBlock)

Mathml: TypeAlias = Callable[[str, bool], str]
"""Gives a formula, which stands on a line of its own or not; empty for one that cannot be set."""


class IndexReader(Protocol):
    """Reads what the search finds of a block."""

    def add(self, kind: Literal["text", "code", "formula", "output"], text: str) -> None:
        """Read a text, unless there is nothing in it."""

    def also(self, name: str) -> None:
        """Read a name by which the section is found as well."""

    def blocks(self, blocks: Iterable[Block]) -> None:
        """Read the blocks inside."""

    def text(self, inlines: Iterable[Inline]) -> str:
        """A line of Markdown as text."""

    def shown(self, block: FeatureBlock) -> Struct | None:
        """The block's `values`, where its kind has some."""


class MarkdownWriter(Protocol):
    """Writes a document as Markdown that every reader understands."""

    @property
    def page(self) -> PageContext:
        """The document on its page."""

    @property
    def live(self) -> str:
        """The address of that page, where what moves can be seen."""

    def blocks(self, blocks: tuple[Block, ...]) -> str:
        """Blocks as Markdown."""

    def inlines(self, inlines: tuple[Inline, ...]) -> str:
        """Inlines as Markdown in one line."""

    def html(self, html: Markup) -> str:
        """HTML of a template as Markdown."""

    def words(self, key: str, **values: str | int | float) -> str:
        """A text of the interface, as Markdown."""

    def href(self, target: Target) -> str:
        """The address of a link."""

    def locate(self, href: str) -> str:
        """An address as the page has it, as the Markdown has it."""

    def folded(self, label: str, text: str) -> str:
        """A text behind its label, which is shown on demand where that can be."""


class Picture(Struct, frozen=True):
    """A picture of a block, which leads to it."""

    path: str
    """Its site path."""
    width: int
    """Pixels, as the height."""
    height: int
    title: str
    anchor: str
    """The block's, on its page."""


class FenceKind(Struct, Generic[B], frozen=True, kw_only=True):
    """A kind of fence, from its text to a page."""

    name: str
    """The first word of its info string."""
    block: type[B]
    """What `parse` makes."""
    parse: Callable[[Fence, TextParser], Parsed[B | None]]
    """The block, and what is wrong in it. Without a block the text is shown as code."""
    nested: bool = False
    """Whether it may stand in a text of another block, where no lines can be updated."""
    values: Callable[[Library, Place, B], Struct] | None = None
    """What its page shows of the course beside the block, as `page.shown.blocks` has it by the
    block's offset: the page is drawn again where this is another."""
    draw: Callable[[PageContext, B], Markup]
    """The block in a page."""
    markdown: Callable[[MarkdownWriter, B], str]
    """The block as Markdown that every reader understands: for copies, notebooks and e-books."""
    picture: Callable[[B, Struct | None], Picture | None] = lambda block, shown: None
    """A picture of the block for lists of lessons, made with what is shown of its trial."""
    wide: bool = True
    """Whether it takes the whole width of the text, so that no docked block can stand beside it."""
    index: Callable[[IndexReader, B], None] = lambda reader, block: None
    """Gives the search what can be found of the block."""


class PageKind(Struct, frozen=True, kw_only=True):
    """A page that a feature adds to the site, at `NAME/index.html`.

    The interface texts `NAME.title` and `NAME.description` are its title and what it is about.
    """

    name: str
    values: Callable[[Library], Mapping[str, object]]
    """All that the page shows of the course: it is drawn again where this is another."""
    draw: Callable[[Renderer, Mapping[str, Any]], Markup] | None = None
    """What stands below the page's title. Without it the template `NAME.html` has the page."""
    exists: Callable[[Library], bool] = lambda library: True
    """Whether a course has the page."""
    order: int = 100
    """Its place among such pages in the foot of every page, the lowest first."""
    indexed: bool = True
    """Whether it is found by searches, and has a copy in Markdown."""
    form: bool = False
    """Whether it has a form that asks for a page of the site."""

    @property
    def path(self) -> str:
        """Its site path."""
        return f"{self.name}/index.html"


class ModelPart(Struct, frozen=True, kw_only=True):
    """What a feature adds to the page of every model that compiles."""

    facts: Callable[[Library, MjcfModel], Iterable[tuple[str, str]]] = lambda library, model: ()
    """More of what the model is, as pairs of words."""
    values: Callable[[Library, Place, MjcfModel], Struct | None]
    """All else that it shows of the course: the page is drawn again where this is another. `None`:
    nothing of this model."""
    draw: Callable[[Renderer, Any], Markup]
    """What is made of these values."""
    opens: bool = False
    """Whether that stands at the top of the page; if not, below the facts."""
    picture: Callable[[Library, MjcfModel], Picture | None] = lambda library, model: None
    """A picture of the model, for lists of models."""


class PageCopy(Struct, frozen=True, kw_only=True):
    """A file beside a page that says the same in another form."""

    ending: str
    """In the place of `.html`: `.md`."""
    type: str
    """Its media type."""
    text: str
    """Key of the interface text by which a lesson links to it."""
    lessons: bool = False
    """Whether only written lessons have it; if not, all pages but those that scripts fill in."""
    download: bool = False
    """Whether a browser saves it, and does not show it."""


class PagePart(Struct, frozen=True, kw_only=True):
    """What a script brings to life in the pages that have it."""

    mark: str
    """A piece of HTML by which these pages are known, as `data-tabs`; no other part has it."""
    code: str = ""
    """The script, run when the page is parsed."""
    bundled: str = ""
    """The name of a script of coursebuild itself, in the place of `code`."""
    late: bool = False
    """Whether the script of every page loads it, when a reader comes near."""
    kinds: tuple[str, ...] = ()
    """Kinds of pages that have it, where not all do that have the mark."""
    texts: tuple[str, ...] = ()
    """Keys of interface texts that the script asks for, or beginnings of such, which end in a dot.
    """


class Exporter(Struct, frozen=True, kw_only=True):
    """What `coursebuild export NAME` writes: a course in which nothing is wrong, as one file."""

    name: str
    summary: str
    """What it writes, in a few words for `coursebuild export --help`."""
    file: str
    """What the file is called where the command does not say."""
    mark: str
    """How the file of an earlier export is known, which may be replaced: a path in the archive, or
    a text near the beginning of a single file."""
    make: Callable[[ExportContext], Iterable[SiteFile | Diagnostic]]
    """The files of the archive, and warnings of what it cannot hold."""
    archive: bool = True
    """Whether it is a ZIP archive; if not, `make` gives one file."""


class Command(Struct, frozen=True, kw_only=True):
    """A command: `coursebuild NAME`."""

    name: str
    summary: str
    """What it does, in a few words for `coursebuild --help`."""
    module: str
    """The module of its `declare(parser)`, which adds arguments, and of its `run(arguments)`, which
    gives the exit status. It is imported when the command is given, and may import all of
    coursebuild: a feature lies below the commands, and what it does for one above."""


class Trial(Struct, frozen=True):
    """Something of a course that is tried when the course is verified."""

    name: str
    """Unique in the course, as `4.2-lab-1`."""
    owner: str
    """Id of its lesson or page."""
    block: FeatureBlock


class TrialContext(Struct, frozen=True):
    """What trials are given."""

    root: Path
    """The course's folder."""
    course: Course
    models: Mapping[str, CompileResult]
    """Of `models/`, by name."""
    memory: Memory
    """What is remembered of earlier trials, and where results are kept."""
    wrong: Sequence[Diagnostic] = ()
    """What is known to be wrong already: a block in which something is need not be tried."""
    static: bool = False
    """Whether pages are made of the results."""


Tried: TypeAlias = tuple[tuple[TrialResult, ...], tuple[Diagnostic, ...]]
"""What trials gave, and what is wrong."""


class TrialRun(Protocol):
    """Trials that are under way in a thread."""

    def run(self, trials: Sequence[Trial]) -> Tried:
        """Try them in turn."""

    def stop(self) -> None:
        """From another thread: end what runs, and let nothing begin."""


class PublishedTrials(Struct, frozen=True):
    """What a site has of trials."""

    shown: Mapping[str, Struct] = {}
    """What the page of a block shows, by the trial's name."""
    files: tuple[OutputFile, ...] = ()


class Trials(Struct, frozen=True, kw_only=True):
    """What a feature tries when a course is verified."""

    find: Callable[[Course], Iterable[Trial]]
    """All there are in a course, in order."""
    start: Callable[[TrialContext], TrialRun]
    inputs: Callable[[Trial], Inputs | None]
    """What a result depends on besides files; `None` for what is not run."""
    publish: Callable[[Results, Assets], PublishedTrials]
    """What a site needs of the results."""


class Feature(Struct, frozen=True, kw_only=True):
    """What a lesson can hold or a site can offer. Everything but the name is optional."""

    name: str
    needs: tuple[str, ...] = ()
    """Names of the features whose modules it imports."""
    fences: tuple[FenceKind[Any], ...] = ()
    pages: tuple[PageKind, ...] = ()
    summary: Callable[[Document, Mathml], Parsed[Struct | None]] | None = None
    """What other pages show of a document, from all its text; nothing where that says nothing.
    It goes with the document's summary (`Library.summaries`). And what is wrong in it."""
    model_part: ModelPart | None = None
    rules: tuple[Rule, ...] = ()
    """Mistakes that it can name, in addition to the catalogue (`coursebuild.core.text.rules`)."""
    check: Callable[[Course, Iterable[Document]], Iterable[Diagnostic]] | None = None
    """What is wrong in some documents of the course, beside what parsing found."""
    check_runs: Callable[[Course, Iterable[ScriptRun]], Iterable[Diagnostic]] | None = None
    """What is wrong once the scripts have run."""
    unproven: Callable[[Course], Iterable[Diagnostic | str]] | None = None
    """What nothing in the course proves, and lines that sum it up, for `check --truth`."""
    check_models: (
        Callable[[Course, Callable[[FeatureBlock], ModelFacts | None]], Iterable[Diagnostic]] | None
    ) = None
    """What is wrong once models are compiled, given what is known of the model of a block."""
    trials: Trials | None = None
    schemas: Mapping[str, tuple[type[Struct], str]] = {}
    """JSON Schemas for editors, by the name that `coursebuild schema` takes: type and title."""
    refine_schema: Callable[[dict[str, Any]], None] | None = None
    """Adds to the definitions of a schema, by the name of the struct, what types cannot say."""
    texts: Mapping[str, str] = {}
    """Interface texts by language, as TOML; those in English (`en`) stand for missing ones."""
    style: str = ""
    """CSS that every page of the site gets."""
    parts: tuple[PagePart, ...] = ()
    copies: tuple[PageCopy, ...] = ()
    """Those that `files` gives of pages."""
    note: Callable[[PageInputs, PageContext | None, str], bytes] | None = None
    """What `files` has to know of a page, from its inputs, the document on it and its HTML; it is
    kept with the page. Nothing where that says nothing."""
    files: Callable[[SiteContext], Iterable[SiteFile | FileList]] | None = None
    """Further files of the site."""
    exporters: tuple[Exporter, ...] = ()
    """What `coursebuild export` can write."""
    commands: tuple[Command, ...] = ()
    """Further commands, if it is installed: one that a course brings itself has none."""
