"""What a page is drawn from, as values, and what features are given to draw and to make files of.

A page is drawn from its inputs (all that it shows except the text of its document), its document,
and the tool's templates and words, and from nothing else, so it is drawn again only when one of
these changes. What a page needs from the course (where a link leads, what a script printed) has
been looked up already.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Literal, TypeAlias
from urllib.parse import unquote

from markupsafe import Markup
from msgspec import Struct, field
from msgspec.structs import asdict

from coursebuild.core import model
from coursebuild.core.model.results import Outcome, SiteFile
from coursebuild.core.pages import typography, urls
from coursebuild.core.pages.assets import Assets, Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.markup import HtmlWriter
from coursebuild.core.pages.numbering import item_name, number_items, with_row_numbers
from coursebuild.core.pages.references import Reference, ids_and_addresses
from coursebuild.core.pages.renderer import Renderer, Strings, direction
from coursebuild.core.pages.zips import Archive
from coursebuild.core.text.source import Span


class ShownRun(Struct, frozen=True):
    """What a page shows of the run of a script."""

    outcome: Outcome
    missing: tuple[str, ...]
    lines: tuple[tuple[int, str | None], ...] = ()
    """The printed lines that the page quotes, by number from 1; `None` for a missing line."""
    recorded: str = ""
    """When and where a run that the course keeps was made."""
    unrepeated: bool = False
    """Whether what is recorded of it was recorded from this run."""
    versions: tuple[str, ...] = ()
    """What it ran with."""


class ShownDownload(Struct, frozen=True):
    """What a page hands over of a script."""

    href: str
    file: str
    """The name of the file."""
    entry: str
    """The file to run; in an archive, its path there."""
    packages: tuple[str, ...]
    """As installers take them."""
    unknown_modules: tuple[str, ...]
    """What it imports besides, of packages that are not known here."""
    was_run: bool
    """Whether it was run in an empty folder."""

    @property
    def is_archive(self) -> bool:
        return self.file != self.entry


class ShownVerdict(Struct, frozen=True):
    """What a page shows of the comparison of an output."""

    status: Literal["verified", "drift", "volatile", "unchecked"]
    comparison: model.Comparison
    rows: tuple[int, int] = (0, 0)
    """Of a table: how many rows it shows, and of how many that were printed."""


class CitedEntry(Struct, frozen=True):
    """A source that a document cites."""

    id: str
    """Its anchor; `citation` is that of its first citation."""
    citation: str
    html: Markup


class Citations(Struct, frozen=True):
    """What the page of a document shows of sources."""

    texts: Mapping[int, Markup] = field(default_factory=dict)
    """The text of each citation, by its offset."""
    entries: tuple[CitedEntry, ...] = ()
    page: str = ""
    """The address of the page of all sources of the course."""


class DocumentInputs(Struct, frozen=True):
    """What the page of a document shows of the rest of the course and of its results.

    Integer keys are offsets in the document.
    """

    engine: str = ""
    hrefs: Mapping[model.Target, str] = field(default_factory=dict)
    """Addresses of links, relative to the page."""
    names: Mapping[model.Target, str] = field(default_factory=dict)
    """The texts of links to numbered items of other pages that have none of their own."""
    number_prefix: str = ""
    """What stands before the numbers of figures: `4.2.` in a lesson."""
    callouts: Mapping[str, model.CalloutKind] = field(default_factory=dict)
    runs: Mapping[str, ShownRun] = field(default_factory=dict)
    downloads: Mapping[str, ShownDownload] = field(default_factory=dict)
    """What is handed over of the scripts in the document, by path."""
    verdicts: Mapping[int, ShownVerdict] = field(default_factory=dict)
    trials: Mapping[int, Struct] = field(default_factory=dict)
    blocks: Mapping[int, Struct] = field(default_factory=dict)
    """The values that features show with their blocks (`FenceKind.values`)."""
    code_links: Mapping[int, str] = field(default_factory=dict)
    citations: Citations = Citations()
    pictures: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    """See `Course.pictures`: those that the document shows."""
    absent_files: frozenset[str] = frozenset()
    """Paths of pictures that the document shows and the course does not have."""
    keyframes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the keyframes of models, by the model's name."""
    address: str = ""
    """The page's full address; empty if the site's is not known."""


class HighlightedFile(Struct, frozen=True):
    """A file whose syntax is highlighted when the page is drawn."""

    language: str
    text: str
    path: str
    """Its path, which the anchors of its lines are made from."""


class AddedParts(Struct, frozen=True):
    """The parts that features add to the page, by feature; drawn when the page is drawn."""

    values: Mapping[str, Struct]


class GraphNode(Struct, frozen=True):
    """A lesson in a drawing of lessons."""

    id: str
    title: str
    href: str
    status: str
    current: bool
    outside: bool
    """Whether it belongs to another level than the page."""


class LessonGraph(Struct, frozen=True):
    """A graph of lessons that build on each other, drawn when the page is drawn."""

    nodes: tuple[GraphNode, ...]
    edges: tuple[tuple[str, str], ...]
    """Ids of a prerequisite and of the lesson that builds on it."""


Mistakes: TypeAlias = tuple[tuple[int, bool], ...]
"""Where mistakes of a document begin, and whether each is an error."""


class PageHead(Struct, frozen=True):
    """What the frame of a page shows about it."""

    path: str
    kind: str
    """One of `registry.CORE_PAGES`, or the name of a `PageKind`; a class of the style sheet too."""
    title: str
    description: str
    json_ld: Markup = Markup()
    indexed: bool = True
    language: str = ""
    """Empty for that of the course."""


class PageRecord(Struct, frozen=True, array_like=True):
    """What the site must know of a page, without its body."""

    kind: str
    title: str
    indexed: bool
    text: str
    """Characters of its text, as in `record.PageFacts`, sorted, like those of formulas."""
    mathematics: str
    declarations: tuple[str, ...]
    ids: tuple[str, ...]
    """Anchors, sorted; see `references.merge_line_ids`."""
    references: tuple[Reference, ...]
    """The targets of its links, sorted, each once."""
    repeated_ids: tuple[tuple[str, int, int], ...] = ()
    """Ids that several elements have, sorted; each with the start and end of its place in the
    page's document (`PageContext.find_repetition`), or zeros."""
    parts: tuple[str, ...] = ()
    notes: tuple[tuple[str, str], ...] = ()
    """The features' notes of the page: a feature's name and a digest; see `SiteContext`."""


class PageInputs(Struct, frozen=True):
    """The inputs of a page."""

    head: PageHead
    template: str
    values: Mapping[str, object]
    """Values for the template; each `HighlightedFile`, `AddedParts` or `LessonGraph` is drawn."""
    document_inputs: DocumentInputs | None = None
    """Those of its document, if it has one, whose text and contents the template also gets."""


# --- what features are given


class PageContext(HtmlWriter, Struct, frozen=True, dict=True):
    """One document on one page."""

    renderer: Renderer
    inputs: DocumentInputs
    place: urls.Place
    document: model.Document

    @cached_property
    def script_outputs(self) -> Mapping[int, tuple[model.Recording, ...]]:
        """The recordings drawn together with a script, by the script's offset."""
        outputs: dict[int, tuple[model.Recording, ...]] = {}
        for siblings in model.sibling_groups(self.document):
            for number, block in enumerate(siblings):
                if not isinstance(block, model.Script | model.ScriptPart):
                    continue
                if isinstance(block, model.ScriptPart) and block.show == "hidden":
                    continue
                following: list[model.Recording] = []
                for sibling in siblings[number + 1 :]:
                    if isinstance(sibling, model.HtmlBlock) and model.is_comment(sibling):
                        continue  # readers do not see it
                    if not isinstance(sibling, model.Recording) or sibling.script != block.path:
                        break
                    following.append(sibling)
                outputs[block.span.start] = tuple(following)
        return outputs

    @cached_property
    def script_places(self) -> Mapping[int, tuple[model.Script, int]]:
        """The whole script of each block with code of it, and its first line, by its offset."""
        return {
            block.span.start: (script, line)
            for script in model.document_scripts(self.document)
            for block, line in zip(script.parts or (script,), (1, *script.part_lines), strict=True)
        }

    @cached_property
    def numbered_items(self) -> Mapping[int, model.NumberedItem]:
        """What has a number, and other formulas on lines of their own, by offset."""
        return number_items(self.document, self.renderer.mathml)

    @cached_property
    def _names(self) -> Mapping[str, str]:
        prefix = self.inputs.number_prefix
        items = self.numbered_items.values()
        kinds = self.inputs.callouts
        return {item.id: item_name(item, prefix, self.words, kinds) for item in items}

    # what the writer of HTML needs

    @property
    def words(self) -> Strings:
        return self.renderer.words

    @property
    def direction(self) -> Literal["ltr", "rtl"]:
        return direction(self.words.language)

    def href(self, target: model.Target) -> str:
        """The address of a link's target."""
        return self.inputs.hrefs[target]

    def url(self, url: str) -> str:
        """An address as written; that of a file of the course becomes its place in the site."""
        return urls.file_address(self.place, self.document.source.path, url)

    def sides(self, url: str) -> Markup:
        """The attributes that keep the place of an image until it has arrived."""
        size = self.inputs.pictures.get(model.local_file(url, self.document.source.path))
        return Markup(' width="{}" height="{}"').format(*size) if size is not None else Markup()

    def math(self, tex: str) -> Markup:
        """A formula in a line of text."""
        label = self.words("markup.formula")
        return Markup(typography.inline_formula(str(self.renderer.mathml(tex, False)), label))

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, which scrolls if it is too wide."""
        mathml = self.renderer.mathml(tex, True)
        item = self.numbered_items.get(start)
        domain = item.domain if item is not None else None
        if item is not None and item.first_row:
            mathml = with_row_numbers(mathml, item.first_row)
        return self.template(
            "blocks/formula.html",
            mathml=mathml,
            equation=item,
            domain=self.renderer.mathml(domain, False) if domain else domain,
            points=model.IDENTITY_POINTS,
        )

    def number(self, label: model.Label | None) -> str:
        """The name that a label gives, such as "Figure 4.2.3"; empty without one."""
        return self._names.get(label.id, "") if label is not None else ""

    def reference(self, target: model.Target) -> str:
        """The text of a link without one: the number of what it leads to."""
        if isinstance(target, model.UrlTarget) and target.url.startswith("#"):
            return self._names.get(unquote(target.url[1:]), "")
        return self.inputs.names.get(target, "")

    def citation(self, citation: model.Citation) -> Markup:
        """A citation, with links to the references below the text."""
        texts = self.inputs.citations.texts
        return texts.get(citation.span.start) or super().citation(citation)

    def references(self) -> Markup:
        """The sources that the document cites; empty if there are none."""
        citations = self.inputs.citations
        if not citations.entries:
            return Markup()
        return self.template("blocks/references.html", **asdict(citations))

    def code_href(self, code: model.CodeSpan | model.Mjcf) -> str:
        """The address of what inline code names, or of where a listing is edited."""
        return self.inputs.code_links.get(code.span.start, "")

    def find_repetition(self, name: str) -> Span:
        """The place of the second block that draws an element with this id, or of the only one."""

        def has_id(block: model.Block) -> bool:
            return name in ids_and_addresses(str(self.blocks((block,))))[0]

        blocks = [block for block in model.document_blocks(self.document) if has_id(block)]
        ids = {id(block) for block in blocks}
        inner = (b for b in blocks if not any(id(child) in ids for child in model.child_blocks(b)))
        places = [block.span.first_line() for block in inner]
        return next(iter((*places[1:], *places)), self.document.source.span(0, 0))

    # what blocks need

    def blocks(self, content: tuple[model.Block, ...]) -> Markup:
        """Blocks as HTML, without the last line end."""
        return Markup(str.rstrip(self.render_blocks(content), "\n"))

    def footnotes(self) -> Markup:
        """The document's footnotes."""
        return self.render_footnotes(self.document.footnotes)

    def highlight(self, language: str, text: str) -> Markup:
        """Code with its syntax highlighted."""
        return self.renderer.highlight(language, text)

    def template(self, name: str, **values: object) -> Markup:
        """A filled-in template."""
        return self.renderer.render(name, **values)


class NotedPage(Struct, frozen=True):
    """A page that a feature has made a note of."""

    path: str
    kind: str
    """See `PageHead`."""
    id: str
    """The id of its lesson, level, model or page."""
    title: str
    digest: str


class SiteContext(Struct, frozen=True):
    """What a feature makes files of a site from."""

    library: Library
    assets: Assets
    names: Names
    """The names of the files that all pages share."""
    pages: tuple[NotedPage, ...]
    """The pages with a note of this feature, in the order of the site."""
    note: Callable[[str], bytes]
    """Returns the note of a page, by its site path."""
    get_or_make: Callable[[str, Callable[[], bytes]], bytes]
    """Returns what was made under a key before, or makes it."""
    archives: Mapping[str, Archive]
    imports: Callable[[str], frozenset[str]]
    """Returns the modules that a Python text imports."""


class ExportContext(Struct, frozen=True):
    """A course without errors, and what an export can be made from."""

    library: Library
    """The course with its results, words and templates. Its documents are summaries."""
    assets: Assets
    site: Callable[[], Mapping[str, SiteFile]]
    """The files of its site by path, collected on the first call."""
    page: Callable[[model.Document], PageContext]
    """A document with its whole text on its page, ready to be drawn."""
    read: Callable[[str], bytes]
    lesson: model.Lesson | None = None
    """The lesson that an `Exporter` of a lesson writes."""

    @property
    def course(self) -> model.Course:
        return self.library.course
