"""A page that is to be drawn, as a value: everything that it shows but the text of its document.

Entry point: `PageInputs`, with its `PageHead`.

A page is drawn from its inputs, its document, and the tool's templates and words, and from nothing
else: so it need be drawn again only when one of these is another. What inputs are made of are plain
values (texts, numbers, tuples, mappings and data classes of them); what a page looks up in the
course (where a link leads, what a script printed) stands in it as the answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.model import CalloutKind, Comparison, Target
from coursebuild.core.model.results import Outcome


class ShownRun(Struct, frozen=True):
    """What a page may say of the run of a script."""

    outcome: Outcome
    missing: tuple[str, ...]
    """Modules that are not there."""
    lines: tuple[tuple[int, str | None], ...] = ()
    """Lines that it printed, by number from 1, as far as questions of the page ask for them;
    `None` where there is no such line."""
    recorded: str = ""
    """When and where it was made, of a run that the course keeps."""


class ShownVerdict(Struct, frozen=True):
    """What a page says of the comparison of an output."""

    status: Literal["verified", "drift", "volatile", "unchecked"]
    comparison: Comparison


class ShownDocument(Struct, frozen=True):
    """What the page of a document shows of the rest of the course, and of what running it found.

    What stands at a place in the document goes by its offset there.
    """

    engine: str = ""
    """Version of MuJoCo."""
    python: str = ""
    hrefs: Mapping[Target, str] = field(default_factory=dict)
    """Addresses of links, as seen from the page."""
    equations: Mapping[Target, str] = field(default_factory=dict)
    """What links to formulas of other pages say, where they have no text."""
    callouts: Mapping[str, CalloutKind] = field(default_factory=dict)
    runs: Mapping[str, ShownRun] = field(default_factory=dict)
    """By path of the script."""
    verdicts: Mapping[int, ShownVerdict] = field(default_factory=dict)
    trials: Mapping[int, Struct] = field(default_factory=dict)
    """What features show of what was tried."""
    blocks: Mapping[int, Struct] = field(default_factory=dict)
    """What features show of the course beside their blocks."""
    keyframes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the keyframes of models, by the model's name."""
    address: str = ""
    """The page's full address; empty where nobody knows where the site will stand."""


class Highlighted(Struct, frozen=True):
    """A file whose tokens are marked when the page is drawn."""

    language: str
    text: str
    path: str
    """By which its lines are linked to."""


class AddedParts(Struct, frozen=True):
    """What features add to the page, drawn when the page is: by the name of the feature."""

    values: Mapping[str, Struct]


class GraphNode(Struct, frozen=True):
    """A lesson in a drawing of lessons."""

    id: str
    title: str
    href: str
    status: str
    current: bool
    """Whether it is the lesson of the page."""
    outside: bool
    """Whether it is of another level than the page's."""


class Graphed(Struct, frozen=True):
    """Which lessons build on which, drawn when the page is: for wide and narrow screens."""

    nodes: tuple[GraphNode, ...]
    """In the order of the course."""
    edges: tuple[tuple[str, str], ...]
    """Ids: what is needed, and what needs it."""


class PageHead(Struct, frozen=True):
    """What the frame of a page shows of it."""

    path: str
    """Its site path."""
    kind: str
    """One of `registry.CORE_PAGES`, or the name of a `PageKind`; a class of the style sheet too."""
    title: str
    description: str
    json_ld: Markup = Markup()
    indexed: bool = True
    """Whether search engines should list it."""


class PageInputs(Struct, frozen=True):
    """A page that is to be drawn."""

    head: PageHead
    template: str
    values: Mapping[str, object]
    """For the template; `Highlighted`, `AddedParts` and `Graphed` among them are drawn first."""
    document: str | None = None
    """The path of its document, whose text and contents the template gets as well."""
    shown: ShownDocument | None = None
