"""The registry of features: loads them once, and collects what they offer."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from inspect import isgenerator
from pathlib import Path
from typing import Any, get_args

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.store import Store
from coursebuild.core.features import (
    API,
    Exporter,
    Feature,
    FenceKind,
    ModelPart,
    PageCopy,
    PageKind,
    PagePart,
    Trial,
    Trials,
)
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model import Course, Document, FeatureBlock
from coursebuild.core.model.results import Mathml, PublishedTrials, Results, ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import Citations
from coursebuild.core.pages.library import Library
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.syntax.fence import Fence, TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.regex import regex
from coursebuild.core.text.rules import RULES, Severity
from coursebuild.core.text.source import Span

GROUP = "coursebuild.features"
"""The group of entry points under which packages offer features."""
CORE_PAGES = ("home", "level", "lesson", "stub", "models", "model", "page", "notfound")
"""The kinds of pages that every site has."""
_FOLDERS = ("assets", "examples", "files", "lessons", "levels", "models")
CORE_FENCES = ("mjcf", "output", "python", "text")
CORE_COMMANDS = {
    "build": "verify everything and publish the site",
    "check": "verify everything without publishing",
    "update": "bring recorded outputs up to date",
    "undo": "undo the last change of `check --fix` or the preview",
    "extract": "write the scripts to examples/",
    "serve": "preview the course and follow every change",
    "export": "verify everything and export the course as one file",
    "explain": "explain a rule, or why something would run again",
    "schema": "print a JSON Schema for editors",
    "completion": "print a shell completion script",
}
"""The core's own commands with a summary, each in the module `coursebuild.cli.NAME`."""

_INSTALLED_BY = {
    "bench": "coursebuild with its recorded reports",
    "io": "coursebuild with its io cards",
    "lab": "coursebuild with its labs",
    "mermaid": "`coursebuild[mermaid]`",
    "quiz": "coursebuild with its quizzes",
    "tabs": "`coursebuild[tabs]`",
}
"""Where the features come from that courses commonly use, for messages."""

_NEWER = "install a newer coursebuild"
_PAGE_NAME = regex("[a-z][a-z0-9-]*")

_of_course: tuple[Feature, ...] = ()
_digest = ""


@functools.cache
def features() -> tuple[Feature, ...]:
    """All features that the course can use, in the order of their names."""
    return _register((*installed_features(), *_of_course))


def use_course_features(course_features: Iterable[Feature], digest: str) -> None:
    """Set the course's own features, and a hash of their code."""
    global _of_course, _digest
    for name in _names(_of_course, "rules"):
        RULES.pop(name, None)
    _of_course, _digest = _register(map(_name_failures, course_features)), digest
    for table in (features, _by_fence, _by_block, page_kinds, parts_by_mark):
        table.cache_clear()


def features_digest() -> str:
    """A hash over the code of all features except coursebuild's own."""
    return hashlib.sha256("\0".join((_digest, *_package_lines())).encode()).hexdigest()


def find_clash(candidate: Feature, installed: Iterable[Feature]) -> str:
    """Why a feature cannot be used, or not together with others; empty if it can."""
    installed = tuple(installed)
    if candidate.api > API:
        return f"it needs version {candidate.api} of `coursebuild.api`, and this is {API}: {_NEWER}"
    if any(feature.name == candidate.name for feature in installed):
        return f"two features are called `{candidate.name}`"
    invisible = [kind for kind in candidate.fences if kind.block.summary is FeatureBlock.summary]
    if invisible and (
        candidate.check or candidate.check_runs or candidate.pages or candidate.exporters
    ):
        return f"it would see no `{invisible[0].name}` of the course: its block has no `summary`"
    odd = [kind.name for kind in candidate.pages if not _PAGE_NAME.fullmatch(kind.name)]
    if odd:
        return f"a page cannot be called `{odd[0]}`: use small letters, digits and `-`"
    for rule in candidate.rules:
        if rule.severity not in get_args(Severity):
            return f"the severity of `{rule.name}` is not `error`, `warning` or `hint`"
    core_rules = RULES.keys() - _names(_of_course, "rules")
    for field, core_names, message in (
        ("rules", core_rules, "there is already a rule `{}`"),
        ("fences", CORE_FENCES, "there is already a fence `{}`"),
        ("pages", (*CORE_PAGES, *_FOLDERS), "there is already a page `{}`"),
        ("exporters", (), "there is already an export `{}`"),
        ("commands", CORE_COMMANDS, "there is already a command `{}`"),
    ):
        if twice := _names((candidate,), field) & _names(installed, field).union(core_names):
            return message.format(min(twice))
    return ""


def fence_kind(name: str) -> FenceKind[Any] | None:
    """The kind of fence with this name."""
    return _by_fence().get(name)


def fence_names() -> tuple[str, ...]:
    """The names of the fences that features read."""
    return tuple(_by_fence())


def kind_of_block(block: FeatureBlock) -> FenceKind[Any]:
    """The kind of fence that a block was parsed from."""
    return _by_block()[type(block)]


def find_exporter(name: str) -> Exporter | str:
    """The exporter of this name, or a message that says why there is none."""
    available = features()
    for feature in available:
        for exporter in feature.exporters:
            if exporter.name == name:
                missing = sorted(set(feature.needs) - {installed.name for installed in available})
                if not missing:
                    return exporter
                source = _INSTALLED_BY.get(missing[0], f"the feature `{missing[0]}`")
                return f"`export {name}` needs {missing[0]}: install {source}"
    names = ", ".join(sorted(_names(available, "exporters")))
    return f"there is no export `{name}`: choose from {names}"


def missing_package(name: str) -> str:
    """The package to install for a fence that no feature reads; empty for other code."""
    return "" if name in _by_fence() else _INSTALLED_BY.get(name, "")


def added_pages(library: Library) -> tuple[PageKind, ...]:
    """The pages that features add to a course, in the order of menus."""
    return tuple(kind for kind in page_kinds() if kind.exists(library))


@functools.cache
def page_kinds() -> tuple[PageKind, ...]:
    """The pages that features add, in the order of menus."""
    kinds = (kind for feature in features() for kind in feature.pages)
    return tuple(sorted(kinds, key=lambda kind: (kind.order, kind.name)))


def page_kind(name: str) -> PageKind | None:
    """The page of this name that a feature adds."""
    return next((kind for kind in page_kinds() if kind.name == name), None)


def model_parts() -> dict[str, ModelPart]:
    """What features add to the pages of models, by the name of the feature."""
    return dict(_offers("model_part"))


def has_copies(page: str) -> bool:
    """Whether there are copies of a page; pages filled in by scripts have none."""
    filled = (kind.path for kind in page_kinds() if not kind.indexed)
    return page != urls.NOT_FOUND and page not in filled


@functools.cache
def parts_by_mark() -> dict[str, PagePart]:
    """The parts that features add to pages, by mark."""
    return {part.mark: part for feature in features() for part in feature.parts}


def page_copies() -> tuple[PageCopy, ...]:
    """The kinds of copies that features make of pages, downloads first."""
    copies = (copy for feature in features() for copy in feature.copies)
    return tuple(sorted(copies, key=lambda copy: not copy.download))


def unproven(course: Course) -> tuple[Diagnostic, ...]:
    """What the course states, and nothing in it gives."""
    return tuple(entry for _, find in _offers("unproven") for entry in find(course))


def summarize(document: Document, mathml: Mathml) -> Parsed[dict[str, Struct]]:
    """The summaries of a document that features make, by feature, and what is wrong in it."""
    summaries = {name: make(document, mathml) for name, make in _offers("summary")}
    values = {
        name: summary.value for name, summary in summaries.items() if summary.value is not None
    }
    diagnostics = [d for summary in summaries.values() for d in summary.diagnostics]
    for _, check in _offers("check_document"):
        diagnostics += check(document)
    return Parsed(values, tuple(diagnostics))


def read_references(
    course: Course, store: Store, interpreter: Interpreter | None
) -> dict[str, Struct]:
    """What features read of the environment of the scripts, by feature."""
    references = {name: read(course, store, interpreter) for name, read in _offers("reference")}
    return {name: value for name, value in references.items() if value is not None}


def losses_against(course: Course, python: str) -> tuple[Diagnostic, ...]:
    """What a course would lose with the MuJoCo of another interpreter."""
    return tuple(lost for _, find in _offers("against") for lost in find(course, python))


def citations(library: Library, place: urls.Place, document: Document) -> Citations:
    """What a document's page shows of the sources that it cites."""
    results = (find(library, place, document) for _, find in _offers("citations"))
    return next((citations for citations in results if citations.texts), Citations())


def code_links(library: Library, place: urls.Place, document: Document) -> dict[int, str]:
    """The addresses to which code in a document leads, by the offset of the code."""
    links: dict[int, str] = {}
    for _, find in _offers("code_links"):
        links |= find(library, place, document)
    return links


def check_runs(course: Course, runs: Iterable[ScriptRun]) -> tuple[Diagnostic, ...]:
    """The diagnostics of features about finished runs of scripts."""
    runs = tuple(runs)
    return tuple(mistake for _, check in _offers("check_runs") for mistake in check(course, runs))


def feature_trials(course: Course) -> dict[str, tuple[Trials, Trial]]:
    """The trials of all features by name, in order; each with its kind."""
    kinds = _offers("trials")
    return {trial.name: (kind, trial) for _, kind in kinds for trial in kind.find(course)}


def publish_trials(results: Results, assets: Assets) -> PublishedTrials:
    """The parts of trial results that a site needs."""
    parts = [kind.publish(results, assets) for _, kind in _offers("trials")]
    values = {name: value for part in parts for name, value in part.values.items()}
    return PublishedTrials(values, tuple(file for part in parts for file in part.files))


@functools.cache
def installed_features() -> tuple[Feature, ...]:
    """The features of coursebuild and of packages; EffectError for one that is broken."""
    package = importlib.import_module("coursebuild.features")
    # Not by `pkgutil`, which takes an unreadable folder for an empty one.
    folders = Path(package.__path__[0]).iterdir()
    modules = sorted(path.name for path in folders if (path / "__init__.py").is_file())
    available = [importlib.import_module(f"{package.__name__}.{name}").FEATURE for name in modules]
    for point in _entry_points():
        subject = f"the entry point {point.value}"
        try:
            feature = point.load()
        except ImportError as error:
            if error.name != "coursebuild.api":
                raise
            message = f"{subject} cannot be used: {error.msg}"
            raise EffectError(message, help=_NEWER) from None
        if not isinstance(feature, Feature):
            raise EffectError(f"{subject} is not a feature", help=f"write `{point.module}:FEATURE`")
        if reason := find_clash(feature, available):
            raise EffectError(f"{subject} cannot be used: {reason}")
        available.append(feature)
    return _register(map(_name_failures, available))


_RESULTS: dict[str, type] = {
    "draw": Markup,
    "markdown": str,
    "check": Iterable,
    "check_document": Iterable,
    "check_runs": Iterable,
    "check_models": Iterable,
    "files": Iterable,
    "make": Iterable,
}
"""What functions of features return, by their fields."""


def _name_failures(offer: Any, feature: str = "", field: str = "") -> Any:
    """A feature, or a part of it, whose functions say whose they are where they raise."""
    if isinstance(offer, Feature | FenceKind | PageKind | ModelPart | Exporter | Trials):
        name = offer.name if isinstance(offer, Feature) else feature
        parts = {f: _name_failures(getattr(offer, f), name, f) for f in offer.__struct_fields__}
        if isinstance(offer, FenceKind):
            parts["parse"] = _name_failures(_check_result(offer), name, "parse")
        return replace(offer, **parts)
    if isinstance(offer, tuple):
        return tuple(_name_failures(part, feature, field) for part in offer)
    if not callable(offer) or isinstance(offer, type):
        return offer
    subject = f"`{field}` of the feature `{feature}`"

    @functools.wraps(offer)
    def call(*arguments: Any, **keywords: Any) -> Any:
        def iterate(values: Iterator[Any]) -> Iterator[Any]:
            with _named_failure(subject, arguments):
                yield from values

        with _named_failure(subject, arguments):
            result = offer(*arguments, **keywords)
            expected = _RESULTS.get(field, object)
            if not isinstance(result, expected):
                got = type(result).__name__
                raise TypeError(
                    f"it returned a value of the type {got} instead of {expected.__name__}"
                )
        return iterate(result) if isgenerator(result) else result

    return call


@contextmanager
def _named_failure(subject: str, arguments: Iterable[object]) -> Iterator[None]:
    """Note with an exception what has failed, and for which text; its traceback shows the note."""
    try:
        try:
            yield
        except SystemExit as error:  # the command would end here, with any status
            raise RuntimeError("a feature cannot end a command") from error
    except Exception as error:
        places = []
        for argument in arguments:
            span = getattr(argument, "span", None)
            document = getattr(argument, "document", argument)
            if isinstance(span, Span):
                places.append(f"{span.path}:{span.line}")
            elif isinstance(document, Document):
                places.append(document.source.path)
        error.add_note(f"this is {subject}" + (f", for {places[-1]}" if places else ""))
        raise


def _check_result(kind: FenceKind[Any]) -> Callable[[Fence, TextParser], Parsed[Any]]:
    """The parsing function of a kind of fence, which raises where it returns something else."""

    def parse(fence: Fence, texts: TextParser) -> Parsed[Any]:
        parsed_block: object = kind.parse(fence, texts)
        if not isinstance(parsed_block, Parsed):
            got = f"a value of the type {type(parsed_block).__name__}"
        elif not isinstance(parsed_block.value, kind.block | None):
            got = f"`Parsed` with a value of the type {type(parsed_block.value).__name__}"
        else:
            return parsed_block
        name = kind.block.__name__
        raise TypeError(
            f"`parse` returned {got}; return `Parsed(block, diagnostics)`, "
            f"where the block is of the type {name}, or None"
        )

    return parse


@functools.cache
def _entry_points() -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=GROUP))


@functools.cache
def package_paths() -> tuple[str, ...]:
    """The folders or files of the packages that offer features."""
    paths: set[str] = set()
    for point in _entry_points():
        spec = importlib.util.find_spec(point.module.partition(".")[0])
        if spec is not None:
            paths.update(spec.submodule_search_locations or (spec.origin or "",))
    return tuple(sorted(paths - {""}))


@functools.cache
def _package_lines() -> tuple[str, ...]:
    """A line with the stat of each file of these packages."""
    lines: list[str] = []
    for path in map(Path, package_paths()):
        for file in sorted(path.rglob("*")) if path.is_dir() else (path,):
            if file.is_file() and "__pycache__" not in file.parts:
                status = file.stat()
                lines.append(f"{file}\0{status.st_size}\0{status.st_mtime_ns}")
    return tuple(lines)


def _offers(field: str) -> Iterator[tuple[str, Any]]:
    """What features offer in one field, with their names."""
    offers = ((feature.name, getattr(feature, field)) for feature in features())
    return ((name, offer) for name, offer in offers if offer is not None)


def _names(features: Iterable[Feature], field: str) -> set[str]:
    return {offer.name for feature in features for offer in getattr(feature, field)}


def _register(features: Iterable[Feature]) -> tuple[Feature, ...]:
    """Sort features by name, and enter their rules into the catalogue."""
    ordered = tuple(sorted(features, key=lambda feature: feature.name))
    RULES.update((rule.name, rule) for feature in ordered for rule in feature.rules)
    return ordered


@functools.cache
def _by_fence() -> dict[str, FenceKind[Any]]:
    return {kind.name: kind for feature in features() for kind in feature.fences}


@functools.cache
def _by_block() -> dict[type[FeatureBlock], FenceKind[Any]]:
    return {kind.block: kind for feature in features() for kind in feature.fences}
