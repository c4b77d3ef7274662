"""The features that there are: found once, and asked for what the tool needs of them.

Entry points: `features()`; `fence_kind`, `kind_of_block`, `page_kinds` and `find_exporter`, which
find what features offer; `check_runs`, `feature_trials` and `publish_trials`, which ask them all.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import re
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from coursebuild.core.features import (
    Exporter,
    Feature,
    FenceKind,
    Mathml,
    ModelPart,
    PageCopy,
    PageKind,
    PublishedTrials,
    Trial,
    Trials,
)
from coursebuild.core.model import Course, Document, FeatureBlock
from coursebuild.core.model.results import Results, ScriptRun
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.rules import RULES

if TYPE_CHECKING:
    from coursebuild.core.pages.assets import Assets


GROUP = "coursebuild.features"
"""The group of entry points under which packages offer features."""
CORE_PAGES = ("home", "level", "lesson", "stub", "models", "model", "page", "notfound")
"""The kinds of pages that every site has."""
_FOLDERS = ("assets", "examples", "files", "lessons", "levels", "models")
"""Folders of every site."""
CORE_FENCES = ("mjcf", "python", "text")
"""The kinds of fences that the core reads."""
CORE_COMMANDS = {
    "build": "verify everything and publish the site",
    "check": "verify, publish nothing",
    "update": "bring recorded outputs up to date",
    "extract": "write the scripts to examples/",
    "serve": "preview: build, serve, rebuild and reload on change",
    "export": "verify everything and write the course as one file",
    "explain": "say what a rule means, or why something would run again",
    "schema": "print a JSON Schema for an editor",
    "completion": "print the completion script of a shell",
}
"""The commands of every course, each in the module `coursebuild.cli.NAME`, and what they do."""

_INSTALLED_BY = {
    "bench": "coursebuild with its recorded reports",
    "io": "coursebuild with its io cards",
    "lab": "coursebuild with its labs",
    "mermaid": "`plugins/mermaid` of coursebuild",
    "quiz": "coursebuild with its quizzes",
    "tabs": "`plugins/tabs` of coursebuild",
}
"""What has to be installed for features that a course written for coursebuild may use."""

_PAGE_NAME = re.compile("[a-z][a-z0-9-]*")

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
    if unseen and (added.check or added.check_runs or added.pages or added.exporters):
        return f"it would see no `{unseen[0].name}` of the course: its block has no `summary`"
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
    if exporters:
        return f"there is an export `{min(exporters)}` already"
    commands = {*CORE_COMMANDS, *(command.name for each in known for command in each.commands)}
    twice = [command.name for command in added.commands if command.name in commands]
    return f"there is a command `{twice[0]}` already" if twice else ""


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


def model_parts() -> dict[str, ModelPart]:
    """What features add to the pages of models, by the name of the feature."""
    parts = ((feature.name, feature.model_part) for feature in features())
    return {name: part for name, part in parts if part is not None}


def page_copies() -> tuple[PageCopy, ...]:
    """The kinds of copies that features make of pages, those to be downloaded first."""
    copies = (copy for feature in features() for copy in feature.copies)
    return tuple(sorted(copies, key=lambda copy: not copy.download))


def unproven(course: Course) -> tuple[Diagnostic | str, ...]:
    """What nothing in the course proves, and lines that sum it up."""
    lists = (feature.unproven for feature in features() if feature.unproven is not None)
    return tuple(found for one in lists for found in one(course))


def summarize(document: Document, mathml: Mathml) -> Parsed[dict[str, Struct]]:
    """What features have of a document, by their names, and what they find wrong in it."""
    makers = {f.name: f.summary for f in features() if f.summary is not None}
    made = {name: make(document, mathml) for name, make in makers.items()}
    values = {name: one.value for name, one in made.items() if one.value is not None}
    return Parsed(values, tuple(found for one in made.values() for found in one.diagnostics))


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
    # Not by `pkgutil`, to which a folder that cannot be read is an empty one.
    folders = Path(package.__path__[0]).iterdir()
    modules = sorted(path.name for path in folders if (path / "__init__.py").is_file())
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
