"""The interface of features: kinds of fences and pages, files of a site, exports, commands.

A feature is a module with a `FEATURE`, in `coursebuild.features`, under the entry points
`coursebuild.features` of any installed package, or in a file that the course map names; see
docs/how-to/features.md. What the core asks of a parsed block are methods of `FeatureBlock`
(`core.model`), so that a parsed course can be used without loading its features.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Literal, Protocol, TypeAlias, TypeVar

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.engine.store import Store
from coursebuild.core.model import Block, Course, Document, FeatureBlock, Inline, MjcfModel, Target
from coursebuild.core.model.results import (
    CompileResult,
    FileList,
    Mathml,
    ModelFacts,
    PublishedTrials,
    Results,
    ScriptRun,
    SiteFile,
    TrialResult,
)
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import (
    Citations,
    ExportContext,
    PageContext,
    PageInputs,
    SiteContext,
)
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.pages.urls import Place
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.run_store import RunStore
from coursebuild.core.run.sandbox import Sandbox
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.script_server import RunAll
from coursebuild.core.syntax.fence import Fence, TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Span

API = 1
"""The version of `coursebuild.api`: each release that adds to it raises it by one."""

B = TypeVar("B", bound=FeatureBlock)


class IndexReader(Protocol):
    """Collects what the search can find of a block."""

    def add(self, kind: Literal["text", "code", "formula", "output"], text: str) -> None:
        """Add a text, unless it is blank."""

    def add_name(self, name: str) -> None:
        """Add a further name by which the section is found."""

    def blocks(self, blocks: Iterable[Block]) -> None:
        """Add the blocks inside."""

    def text(self, inlines: Iterable[Inline]) -> str:
        """Inlines as text."""

    def values(self, block: FeatureBlock) -> Struct | None:
        """The result of `FenceKind.values` for the block, if its kind has that."""


class MarkdownWriter(Protocol):
    """Writes a document as Markdown that every reader understands."""

    @property
    def page(self) -> PageContext:
        """The document on its page."""

    @property
    def live(self) -> str:
        """The address of that page, where moving things can be seen."""

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
        """An address on the page, converted for the Markdown."""

    def folded(self, label: str, text: str) -> str:
        """A text folded under its label, where folding is possible."""


class Picture(Struct, frozen=True):
    """A picture of a block that links to it."""

    path: str
    """Its path in the site."""
    width: int
    """Pixels, as the height."""
    height: int
    title: str
    anchor: str
    film: str = ""
    """The path of a moving picture of the same proportions."""


class FenceKind(Struct, Generic[B], frozen=True, kw_only=True):
    """A kind of fence: its parsing, drawing and other forms."""

    name: str
    """The first word of its info string."""
    block: type[B]
    parse: Callable[[Fence, TextParser], Parsed[B | None]]
    """The block and its diagnostics. Without a block the text is shown as code."""
    label: str = ""
    """The prefix of its labels, one of `LABEL_KINDS`; without one it has no number. What it draws
    and writes shows the number, `PageContext.number`, with the id of the label."""
    nested: bool = False
    """Whether it may be inside a text of another block, where `update` cannot edit lines."""
    values: Callable[[Library, Place, B], Struct] | None = None
    """What the page shows with the block of the rest of the course; found in `page.inputs.blocks`
    under the block's offset. The page is drawn again when it changes."""
    draw: Callable[[PageContext, B], Markup]
    markdown: Callable[[MarkdownWriter, B], str]
    """The block as Markdown that every reader understands: for copies, notebooks and e-books."""
    picture: Callable[[B, Struct | None], Picture | None] = lambda block, value: None
    """A picture of the block for lists of lessons, given the published value of its trial."""
    wide: bool = True
    """Whether it takes the whole width of the text, so that no block can be docked beside it."""
    docked: Callable[[B], bool] = lambda block: False
    """Whether it stands beside the text on a wide screen."""
    index: Callable[[IndexReader, B], None] = lambda reader, block: None
    """Adds what the search can find of the block."""
    scopes: Callable[[B], tuple[Span, ...]] = lambda block: (block.span,)
    """Parts that stand for themselves, as questions do: what one assumes holds in it alone."""


class PageKind(Struct, frozen=True, kw_only=True):
    """A page of a feature at `NAME/index.html`, with texts `NAME.title` and `NAME.description`."""

    name: str
    values: Callable[[Library], Mapping[str, object]]
    """Everything that the page shows of the course; it is drawn again when this changes."""
    draw: Callable[[Renderer, Mapping[str, Any]], Markup] | None = None
    """The content below the page's title. Without it, the template `NAME.html` is used."""
    exists: Callable[[Library], bool] = lambda library: True
    parts: Callable[[Library], Iterable[str]] = lambda library: ()
    """The ids of further pages, each at `NAME/ID.html`, that are drawn by `NAME-part.html`."""
    part_values: Callable[[Library, str], Mapping[str, object]] = lambda library, part: {}
    """Everything that one of these shows of the course, with its `title`."""
    order: int = 100
    """Its place in the foot of every page, the lowest first."""
    indexed: bool = True
    """Whether it is found by searches, and has a copy in Markdown."""
    form: bool = False
    """Whether it has a form that leads to a page of the site; browsers send no other."""

    @property
    def path(self) -> str:
        return f"{self.name}/index.html"

    def part_path(self, part: str) -> str:
        """The path of a further page."""
        return f"{self.name}/{part}.html"


class ModelPart(Struct, frozen=True, kw_only=True):
    """What a feature adds to the page of every model that compiles."""

    facts: Callable[[Library, MjcfModel], Iterable[tuple[str, str]]] = lambda library, model: ()
    """Further facts about the model, as pairs of label and value."""
    values: Callable[[Library, Place, MjcfModel], Struct | None]
    """Everything else that it shows of the course; the page is drawn again when this changes.
    `None` if it shows nothing of this model."""
    draw: Callable[[Renderer, Any], Markup]
    opens: bool = False
    """Whether it comes at the top of the page, and not below the facts."""
    picture: Callable[[Library, MjcfModel], Picture | None] = lambda library, model: None
    """A picture of the model, for lists of models."""


class PageCopy(Struct, frozen=True, kw_only=True):
    """A file with the content of a page in another form."""

    ending: str
    """The ending that replaces `.html`, such as `.md`."""
    type: str
    text: str
    """Key of the interface text by which a lesson links to it."""
    lessons: bool = False
    """Whether only written lessons have it, and not all pages with text of their own."""
    download: bool = False
    """Whether a browser saves it instead of showing it."""
    services: Callable[[Course, str], tuple[tuple[str, str], ...]] = lambda course, path: ()
    """The names of services that can open the copy at a site path, with their addresses."""


class PagePart(Struct, frozen=True, kw_only=True):
    """A script, and the pages that it is for."""

    mark: str
    """A piece of HTML that marks these pages, such as `data-tabs`; unique to this part."""
    code: str = ""
    """The script, which runs once the page is parsed."""
    bundled: str = ""
    """The name of a script of coursebuild itself, instead of `code`."""
    late: bool = False
    """Whether the scripts of all pages load it, when it is needed."""
    kinds: tuple[str, ...] = ()
    """The kinds of pages it is for, if not all with the mark."""
    texts: tuple[str, ...] = ()
    """Keys of interface texts that the script uses, or prefixes of keys, which end in a dot."""
    evaluates: bool = False
    """Whether a worker under the policy of these pages makes functions of texts."""


class Exporter(Struct, frozen=True, kw_only=True):
    """What `coursebuild export NAME` writes: a course without errors as one file."""

    name: str
    summary: str
    """A few words on what it writes, for the help of `coursebuild export`."""
    file: str
    """Its name where `--out` gives none."""
    mark: str
    """The sign of an earlier export, which may be replaced: a path in the archive, or a text near
    the beginning of a single file."""
    make: Callable[[ExportContext], Iterable[SiteFile | Diagnostic]]
    """The files of the archive, and warnings about what it cannot hold."""
    archive: bool = True
    """Whether it is a ZIP archive; otherwise `make` yields a single file."""
    of_lesson: bool = False
    """Whether it writes a lesson that is named (`context.lesson`), to `LESSON-` and its `file`."""


class Command(Struct, frozen=True, kw_only=True):
    """A command: `coursebuild NAME`."""

    name: str
    summary: str
    """A few words on what it does, for `coursebuild --help`."""
    module: str
    """The module with `declare(parser)`, which adds arguments, and `run(arguments)`, which returns
    the exit status. It is imported when the command is called."""


def on_demand(name: str) -> Any:
    """A function, given as `module:name`, whose module is imported when it is first called."""
    module, _, function = name.partition(":")

    def call(*arguments: Any, **keywords: Any) -> Any:
        return getattr(importlib.import_module(module), function)(*arguments, **keywords)

    return call


class Executor(Protocol):
    """Other processes, perhaps on other machines, that do what a command would do in this one."""

    @property
    def run(self) -> RunAll:
        """Runs scripts, as `ScriptServer.run` does."""

    def map(self, function: str, root: Path, tasks: Sequence[bytes]) -> Iterator[bytes]:
        """Apply a function, given as `module:name`, to tasks; yield the results in their order.

        It is called with the folder of a copy of the course that lies at `root`, and with a task.
        An empty result means that the task is left to this process.
        """

    def close(self) -> None:
        """End all that runs."""


class ExecutorKind(Struct, frozen=True, kw_only=True):
    """An option of `check`, `update`, `bench`, `stability` and `diet` that names an executor."""

    option: str
    metavar: str
    """What stands for its value in the help."""
    help: str
    module: str
    """The module with `start(value, root, jobs, sandbox, say)`, which returns an `Executor`: of the
    option's value, the course's folder, the number of processes that this machine can run, whether
    scripts run in a sandbox, and what tells the user of what takes long. It may raise
    `EffectError`."""


class Trial(Struct, frozen=True):
    """Something in a course that is tried when the course is verified."""

    name: str
    """Unique in the course, as `4.2-lab-1`."""
    owner: str
    """The id of its lesson or page."""
    block: FeatureBlock


class TrialContext(Struct, frozen=True):
    """The context of trials."""

    root: Path
    course: Course
    models: Mapping[str, CompileResult]
    """By the names of files in `models/`, without suffix."""
    run_store: RunStore
    """Notes of earlier trials; its `store` has their results, and takes new ones."""
    diagnostics: Sequence[Diagnostic] = ()
    """Diagnostics so far: a block with one need not be tried."""
    static: bool = False
    """Whether pages will be made from the results."""
    say: Callable[[str], None] = lambda _: None
    """Tells the user of what takes long."""
    sandbox: Sandbox | None = None
    """What encloses all that becomes a program of the course's own; with one, nothing is installed.
    """


TrialOutcome: TypeAlias = tuple[tuple[TrialResult, ...], tuple[Diagnostic, ...]]
"""The results of trials, and what is wrong."""


class TrialRun(Protocol):
    """Trials running in a thread."""

    def run(self, trials: Sequence[Trial]) -> TrialOutcome:
        """Try them in turn."""

    def stop(self) -> None:
        """Called from another thread: end the running trial, and start no other."""


class Trials(Struct, frozen=True, kw_only=True):
    """The trials of a feature when a course is verified."""

    find: Callable[[Course], Iterable[Trial]]
    """All trials of a course, in its order."""
    start: Callable[[TrialContext], TrialRun]
    inputs: Callable[[Trial], Inputs | None]
    """What a result depends on besides files; `None` for a trial that is not run."""
    publish: Callable[[Results, Assets], PublishedTrials]


class Feature(Struct, frozen=True, kw_only=True):
    """Something a lesson can hold or a site can offer. Everything but the name is optional."""

    name: str
    api: int = 1
    """The version of `coursebuild.api` that it needs."""
    needs: tuple[str, ...] = ()
    """Names of the features whose modules it imports."""
    fences: tuple[FenceKind[Any], ...] = ()
    pages: tuple[PageKind, ...] = ()
    summary: Callable[[Document, Mathml], Parsed[Struct | None]] | None = None
    """What other pages show of a document, made from its whole text, with diagnostics. It is kept
    with the document's summary (`Library.summaries`); `None` if there is nothing."""
    model_part: ModelPart | None = None
    rules: tuple[Rule, ...] = ()
    """Mistakes that it reports, besides those of the core."""
    reference: Callable[[Course, Store, Interpreter | None], Struct | None] | None = None
    """What it reads of the environment of the scripts, kept in `course.references`; the interpreter
    is `None` where the one of this tool runs them."""
    citations: Callable[[Library, Place, Document], Citations] | None = None
    """What a document's page shows of the sources that it cites."""
    code_links: Callable[[Library, Place, Document], Mapping[int, str]] | None = None
    """Addresses of what inline code names, and of where listings of MJCF are edited, by the offset
    of the code or the listing, for a document's page."""
    against: Callable[[Course, str], Iterable[Diagnostic]] | None = None
    """What the course would lose with the MuJoCo of another interpreter, of which the path is
    given, for `check --against`."""
    check_document: Callable[[Document], Iterable[Diagnostic]] | None = None
    """The diagnostics about a document, of which it sees the whole text and nothing else."""
    check: Callable[[Course, Collection[Document]], Iterable[Diagnostic]] | None = None
    """The diagnostics about some documents that the whole course shows. It sees what blocks keep in
    their summaries, and no prose."""
    check_runs: Callable[[Course, Iterable[ScriptRun]], Iterable[Diagnostic]] | None = None
    """The diagnostics about what scripts did."""
    unproven: Callable[[Course], Iterable[Diagnostic]] | None = None
    """What the course states, and nothing in it gives, for `check --truth`."""
    proofs: Callable[[Document], Iterable[tuple[Span, Span]]] | None = None
    """Relations in a document that its diagnostics, if there are none, prove: the sides of each,
    both with the sign between them."""
    check_models: (
        Callable[[Course, Callable[[FeatureBlock], ModelFacts | None]], Iterable[Diagnostic]] | None
    ) = None
    """The diagnostics that need compiled models; the function gives those of a block."""
    trials: Trials | None = None
    schemas: Mapping[str, tuple[type[Struct], str]] = {}
    """JSON Schemas for editors by the name that `coursebuild schema` takes: type and title."""
    refine_schema: Callable[[dict[str, Any]], None] | None = None
    """Adds what types cannot say to the definitions of a schema, by the name of the struct."""
    texts: Mapping[str, str] = {}
    """Interface texts by language, as TOML; English ones (`en`) stand in for missing ones."""
    style: str = ""
    parts: tuple[PagePart, ...] = ()
    copies: tuple[PageCopy, ...] = ()
    note: Callable[[PageInputs, PageContext | None, str], bytes] | None = None
    """What `files` must know of a page, made from its inputs, its document and its HTML; it is kept
    with the page. Empty if there is nothing."""
    files: Callable[[SiteContext], Iterable[SiteFile | FileList]] | None = None
    exporters: tuple[Exporter, ...] = ()
    commands: tuple[Command, ...] = ()
    """Further commands; only an installed feature can have some, not one of a course."""
    executors: tuple[ExecutorKind, ...] = ()
    """Options for work in other processes; likewise."""
