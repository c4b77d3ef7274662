"""The interface of features: how kinds of fences and pages, files of a site and exports enter.

Entry points: `Feature`, with `FenceKind`, `PageKind`, `PagePart` and `Exporter`, which say what a
feature has; `features()`, those that there are; `fence_kind`, `kind_of_block`, `page_kind` and
`find_exporter`, which find one.

A feature is a module with a `FEATURE`. It is found in `coursebuild.features`, under the entry
points `coursebuild.features` of any installed package, or in a file that the course map names
(`features = ["features/NAME.py"]`; see `use_course_features`). All three are alike.
docs/features.md says how to write one.

What the core asks of a block after it was parsed are the methods of `FeatureBlock`
(`core.model`), so that a checked course can be looked at without its features being loaded.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypeAlias, TypeVar

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Block, Course, Document, FeatureBlock, Inline
from coursebuild.core.model.results import (
    CompileResult,
    LabResult,
    ModelFacts,
    OutputFile,
    Results,
    ScriptRun,
)
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.rules import RULES, Rule

if TYPE_CHECKING:  # the layers above, of which a feature's functions take values
    from coursebuild.core.model.results import FileList, SiteFile
    from coursebuild.core.pages.added_files import SiteContext
    from coursebuild.core.pages.assets import Assets
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.exports.context import ExportContext
    from coursebuild.core.pages.exports.plain import Plain
    from coursebuild.core.pages.library import Library
    from coursebuild.core.pages.page_inputs import PageInputs
    from coursebuild.core.pages.tools import Tools
    from coursebuild.core.scripts.dependencies import Inputs
    from coursebuild.core.syntax.fence import Fence
    from coursebuild.core.syntax.texts import TextParser
    from coursebuild.pipeline.remember import Memory

B = TypeVar("B", bound=FeatureBlock)

GROUP = "coursebuild.features"
"""The group of entry points under which packages offer features."""


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
    draw: Callable[[PageContext, B], Markup]
    """The block in a page."""
    markdown: Callable[[Plain, B], str]
    """The block as Markdown that every reader understands: for copies, notebooks and e-books."""
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
    draw: Callable[[Tools, Mapping[str, Any]], Markup] | None = None
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


Tried: TypeAlias = tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]
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
    rules: tuple[Rule, ...] = ()
    """Mistakes that it can name, in addition to the catalogue (`coursebuild.core.text.rules`)."""
    check: Callable[[Course, Iterable[Document]], Iterable[Diagnostic]] | None = None
    """What is wrong in some documents of the course, beside what parsing found."""
    check_runs: Callable[[Course, Iterable[ScriptRun]], Iterable[Diagnostic]] | None = None
    """What is wrong once the scripts have run."""
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
    note: Callable[[PageInputs, Document | None, str], bytes] | None = None
    """What `files` has to know of a page, from its inputs, its document and its HTML; it is kept
    with the page. Nothing where that says nothing."""
    files: Callable[[SiteContext], Iterable[SiteFile | FileList]] | None = None
    """Further files of the site."""
    exporters: tuple[Exporter, ...] = ()
    """What `coursebuild export` can write."""


CORE_PAGES = ("home", "level", "lesson", "stub", "model", "page", "notfound")
"""The kinds of pages that every site has."""
_FOLDERS = ("assets", "examples", "files", "lessons", "levels", "models")
"""Folders of every site."""
CORE_FENCES = ("bench", "mjcf", "python", "text")
"""The kinds of fences that the core reads."""

_INSTALLED_BY = {
    "io": "coursebuild with its io cards",
    "lab": "coursebuild with its labs",
    "mermaid": "`plugins/mermaid` of coursebuild",
    "quiz": "coursebuild with its quizzes",
    "tabs": "`plugins/tabs` of coursebuild",
}
"""What has to be installed for features that a course written for coursebuild may use."""

_PAGE_NAME = pattern("[a-z][a-z0-9-]*")

_of_course: tuple[Feature, ...] = ()
_digest = ""


def features() -> tuple[Feature, ...]:
    """All features that a course can use, in the order of their names."""
    return _sorted((*installed_features(), *_of_course))


def use_course_features(found: Iterable[Feature], digest: str) -> None:
    """Set the features that the course at hand brings itself, and a hash of their code."""
    global _of_course, _digest
    for name in _rules_of(_of_course):
        RULES.pop(name, None)
    _of_course, _digest = _sorted(found), digest
    for known in (_by_fence, _by_block, page_kinds):
        known.cache_clear()


def features_digest() -> str:
    """A hash over the code of all features but those of coursebuild itself."""
    return hashlib.sha256("\0".join((_digest, *_package_lines())).encode()).hexdigest()


def clash(added: Feature, known: Iterable[Feature]) -> str:
    """Why a feature cannot be used beside others; empty where it can."""
    known = tuple(known)
    if any(feature.name == added.name for feature in known):
        return f"two features are called `{added.name}`"
    rules = {rule.name for rule in added.rules} & (RULES.keys() - _rules_of(_of_course))
    if rules:
        return f"there is a rule `{min(rules)}` already"
    unseen = [kind for kind in added.fences if kind.block.summary is FeatureBlock.summary]
    if added.check is not None and unseen:
        return f"its check would see no `{unseen[0].name}`, whose block has no `summary`"
    read = {*CORE_FENCES, *(kind.name for feature in known for kind in feature.fences)}
    twice = [kind.name for kind in added.fences if kind.name in read]
    if twice:
        return f"the fence `{twice[0]}` is read already"
    pages = {*CORE_PAGES, *_FOLDERS, *(kind.name for feature in known for kind in feature.pages)}
    twice = [kind.name for kind in added.pages if kind.name in pages]
    if twice:
        return f"there is a page `{twice[0]}` already"
    odd = [kind.name for kind in added.pages if not _PAGE_NAME.fullmatch(kind.name)]
    if odd:
        return f"a page cannot be called `{odd[0]}`: use small letters, digits and `-`"
    exporters = _exporter_names((added,)) & _exporter_names(known)
    return f"there is an export `{min(exporters)}` already" if exporters else ""


def fence_kind(name: str) -> FenceKind[Any] | None:
    """The kind of fence whose info string begins with a word."""
    return _by_fence().get(name)


def fence_names() -> tuple[str, ...]:
    """The first words of the info strings that features read."""
    return tuple(_by_fence())


def kind_of_block(block: FeatureBlock) -> FenceKind[Any]:
    """The kind of fence that a block came from."""
    return _by_block()[type(block)]


def find_exporter(name: str) -> Exporter | str:
    """The exporter of a name, or why there is none."""
    known = features()
    for feature in known:
        for exporter in feature.exporters:
            if exporter.name == name:
                missing = sorted(set(feature.needs) - {other.name for other in known})
                if not missing:
                    return exporter
                source = _INSTALLED_BY.get(missing[0], f"the feature `{missing[0]}`")
                return f"`export {name}` needs {missing[0]}: install {source}"
    return f"there is no export `{name}`: choose from {', '.join(sorted(_exporter_names(known)))}"


def missing_package(name: str) -> str:
    """What would have to be installed for a fence that no feature reads; empty for other code."""
    return "" if name in _by_fence() else _INSTALLED_BY.get(name, "")


@functools.cache
def page_kinds() -> tuple[PageKind, ...]:
    """The pages that features add, in the order in which they are named."""
    kinds = (kind for feature in features() for kind in feature.pages)
    return tuple(sorted(kinds, key=lambda kind: (kind.order, kind.name)))


def page_kind(name: str) -> PageKind | None:
    """The page of a name that a feature adds."""
    return next((kind for kind in page_kinds() if kind.name == name), None)


def check_runs(course: Course, runs: Iterable[ScriptRun]) -> tuple[Diagnostic, ...]:
    """What features find wrong once the scripts have run."""
    runs = tuple(runs)
    checks = (feature.check_runs for feature in features() if feature.check_runs is not None)
    return tuple(found for check in checks for found in check(course, runs))


def feature_trials(course: Course) -> dict[str, tuple[Trials, Trial]]:
    """What features try of a course, by name, in order; each with how it is tried."""
    kinds = (feature.trials for feature in features() if feature.trials is not None)
    return {trial.name: (kind, trial) for kind in kinds for trial in kind.find(course)}


def publish_trials(results: Results, assets: Assets) -> PublishedTrials:
    """What a site needs of what features tried."""
    kinds = (feature.trials for feature in features() if feature.trials is not None)
    published = [kind.publish(results, assets) for kind in kinds]
    shown = {name: value for one in published for name, value in one.shown.items()}
    return PublishedTrials(shown, tuple(file for one in published for file in one.files))


@functools.cache
def installed_features() -> tuple[Feature, ...]:
    """The features of coursebuild itself, and of packages that are installed beside it.

    Raises:
        RuntimeError: two of them cannot be used together, or one is broken.
    """
    package = importlib.import_module("coursebuild.features")
    modules = (module.name for module in pkgutil.iter_modules(package.__path__))
    found = [importlib.import_module(f"{package.__name__}.{name}").FEATURE for name in modules]
    for point in _entry_points():
        feature = point.load()
        if not isinstance(feature, Feature):
            raise RuntimeError(
                f"the entry point {point.value} is no feature: write `{point.module}:FEATURE`"
            )
        if reason := clash(feature, found):
            raise RuntimeError(f"the entry point {point.value} cannot be used: {reason}")
        found.append(feature)
    return _sorted(found)


@functools.cache
def _entry_points() -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=GROUP))


@functools.cache
def package_paths() -> tuple[str, ...]:
    """The folders, or single files, of the packages that offer features."""
    found: set[str] = set()
    for point in _entry_points():
        spec = importlib.util.find_spec(point.module.partition(".")[0])
        if spec is not None:
            found.update(spec.submodule_search_locations or (spec.origin or "",))
    return tuple(sorted(found - {""}))


@functools.cache
def _package_lines() -> tuple[str, ...]:
    """A line for each file of these packages."""
    lines: list[str] = []
    for path in map(Path, package_paths()):
        for file in sorted(path.rglob("*")) if path.is_dir() else (path,):
            if file.is_file() and "__pycache__" not in file.parts:
                status = file.stat()
                lines.append(f"{file}\0{status.st_size}\0{status.st_mtime_ns}")
    return tuple(lines)


def _exporter_names(found: Iterable[Feature]) -> set[str]:
    return {exporter.name for feature in found for exporter in feature.exporters}


def _rules_of(found: Iterable[Feature]) -> set[str]:
    return {rule.name for feature in found for rule in feature.rules}


def _sorted(found: Iterable[Feature]) -> tuple[Feature, ...]:
    known = tuple(sorted(found, key=lambda feature: feature.name))
    RULES.update((rule.name, rule) for feature in known for rule in feature.rules)
    return known


@functools.cache
def _by_fence() -> dict[str, FenceKind[Any]]:
    return {kind.name: kind for feature in features() for kind in feature.fences}


@functools.cache
def _by_block() -> dict[type[FeatureBlock], FenceKind[Any]]:
    return {kind.block: kind for feature in features() for kind in feature.fences}
