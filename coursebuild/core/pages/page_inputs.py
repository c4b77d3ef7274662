"""The inputs of a page: everything that it shows except the text of its document, as a value.

A page is drawn from its inputs, its document, and the tool's templates and words, and from nothing
else, so it is drawn again only when one of these changes. What a page needs from the course (where
a link leads, what a script printed) has been looked up already.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.model import CalloutKind, Comparison, Target
from coursebuild.core.model.results import Outcome


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


class ShownVerdict(Struct, frozen=True):
    """What a page shows of the comparison of an output."""

    status: Literal["verified", "drift", "volatile", "unchecked"]
    comparison: Comparison


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
    python: str = ""
    hrefs: Mapping[Target, str] = field(default_factory=dict)
    """Addresses of links, relative to the page."""
    names: Mapping[Target, str] = field(default_factory=dict)
    """The texts of links to numbered items of other pages that have none of their own."""
    number_prefix: str = ""
    """What stands before the numbers of figures: `4.2.` in a lesson."""
    callouts: Mapping[str, CalloutKind] = field(default_factory=dict)
    runs: Mapping[str, ShownRun] = field(default_factory=dict)
    verdicts: Mapping[int, ShownVerdict] = field(default_factory=dict)
    trials: Mapping[int, Struct] = field(default_factory=dict)
    blocks: Mapping[int, Struct] = field(default_factory=dict)
    """The values that features show with their blocks (`FenceKind.values`)."""
    code_links: Mapping[int, str] = field(default_factory=dict)
    citations: Citations = Citations()
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


class PageHead(Struct, frozen=True):
    """What the frame of a page shows about it."""

    path: str
    kind: str
    """One of `registry.CORE_PAGES`, or the name of a `PageKind`; a class of the style sheet too."""
    title: str
    description: str
    json_ld: Markup = Markup()
    indexed: bool = True


class PageInputs(Struct, frozen=True):
    """The inputs of a page."""

    head: PageHead
    template: str
    values: Mapping[str, object]
    """Values for the template; each `HighlightedFile`, `AddedParts` or `LessonGraph` is drawn."""
    document_inputs: DocumentInputs | None = None
    """Those of its document, if it has one, whose text and contents the template also gets."""
