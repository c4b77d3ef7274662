"""Looks for what a model file holds that its scenarios do not need, and writes it without that.

1. Whoever starts it says who reads the model: texts of code, names that others ask for, files of
   declarations that share a part of it.
2. What is tried is compiled from the bytes that changed files would have.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
from msgspec import Struct
from msgspec.structs import replace

from mjbench.bench import CannotMeasureError, Subject, report_errors
from mjbench.declarations import DeclarationError, Declarations, parse_declarations
from mjbench.fair import fair_scenarios
from mjbench.host import Host
from mjbench.machine import this_machine
from mjbench.pruning.candidates import KINDS
from mjbench.pruning.comparison import pruning_scenes
from mjbench.pruning.model_text import ModelText, ModelTextError, open_model
from mjbench.pruning.readers import VIEWS, ModelReader, read_code
from mjbench.pruning.survey import Surveyor
from mjbench.pruning.xml_edits import MarkupError
from mjbench.reports.diet_report import DietReport, Keep

_NOT_DRAWN = frozenset(("Sensor", "Actuator", "Keyframe", "Numeric", "Tuple"))
"""Kinds that a picture of the model does not show."""
_SHAPES = ("alt", "fromto", "scale")
"""Fields of a specification that give places or sizes, and that a model does not have."""


class ReaderSource(Struct, frozen=True):
    """Something that may read a model."""

    path: str
    """What messages call it."""
    text: str | None = None
    """Code: Python where the path ends so, else JavaScript."""
    declarations: str | None = None
    """A file of declarations, of this or another model that shares a file with it."""
    names: tuple[str, ...] = ()
    """Things that it asks for by name."""
    kinds: tuple[str, ...] = ()
    """Kinds of which it may read any thing."""
    drawn: bool = False
    """Whether it shows a picture of the model."""
    opaque: str = ""
    """Why it may use everything; empty where it does not."""


class FileChange(Struct, frozen=True):
    """A file before and after what is proved was taken out."""

    path: str
    before: bytes
    after: bytes


class DietResult(Struct, frozen=True):
    """A report, and the files without what is proved."""

    report: DietReport
    changes: tuple[FileChange, ...]


def look_at(
    host: Host,
    *,
    subject: Subject,
    readers: Sequence[ReaderSource] = (),
    modules: frozenset[str] = frozenset(),
    keeps: Sequence[Keep] = (),
    locked: Mapping[str, str] | None = None,
    only: Sequence[str] = (),
    quick: bool = False,
    rerun: bool = False,
) -> DietResult:
    """Look at a model; a `CannotMeasureError` where it cannot be done.

    `modules`: those of Python that are among the readers; `locked`: files that must not be changed,
    with the reason; `only`: kinds of findings to look for, else all; `rerun`: whether the host runs
    programs with what is left.
    """
    if unknown := sorted(set(only) - set(KINDS)):
        message = f"no finding is of the kind `{unknown[0]}`"
        raise CannotMeasureError(message, subject.place, f"known: {', '.join(KINDS)}")
    files: dict[str, bytes | None] = {}
    declarations = subject.read_declarations()

    def read(path: str) -> bytes | None:
        if path not in files:
            file = Path(subject.folder, path)
            try:
                files[path] = file.read_bytes() if file.is_file() else None
            except OSError:
                files[path] = None
        return files[path]

    files[subject.path] = subject.data
    text = _open_text(subject, read)
    all_readers = [reader for source in readers for reader in _read(source, modules)]
    all_readers += _declared_readers(declarations)
    with report_errors(subject, _FAILURE, ModelTextError, ValueError):
        if subject.is_fair:
            scenarios = fair_scenarios(text.model, subject.path, quick=quick)
            declarations = replace(declarations, scenarios=scenarios)
        survey = Surveyor(
            model=subject.name,
            digest=subject.digest,
            machine=this_machine(),
            text=text,
            scenes=pruning_scenes(text.model, declarations, quick=quick),
            readers=tuple(all_readers),
            keeps={" ".join(keep.finding.split()): keep for keep in keeps},
            locked=locked or {},
            clock=time.thread_time_ns,
            only=only,
            quick=quick,
            tell=host.tell,
            rerun=host.rerun if rerun else None,
        ).survey()
    changes = sorted(survey.text.files(survey.edits).items())
    return DietResult(
        survey.report, tuple(FileChange(path, read(path) or b"", data) for path, data in changes)
    )


_FAILURE = "the diet cannot look at the model `{}`"


def _open_text(subject: Subject, read: Callable[[str], bytes | None]) -> ModelText:
    with report_errors(subject, _FAILURE, ModelTextError, ValueError):
        try:
            return open_model(subject.path, read, partial(_compile, subject))
        except MarkupError as error:
            message = f"{error.path}:{error.line}:{error.column} is not XML: {error.message}"
            help = "MuJoCo reads it all the same; other tools do not"
            raise CannotMeasureError(message, subject.place, help) from None


def _compile(subject: Subject, files: Mapping[str, bytes]) -> Any:
    """Compile the model from files with these bytes."""
    assets = {str(Path(subject.folder, path)): data for path, data in files.items()}
    try:
        return mujoco.MjModel.from_xml_path(subject.file, assets=assets)
    except (ValueError, mujoco.FatalError) as error:
        raise ValueError(str(error).replace(f"{subject.folder}/", "")) from None


def _read(source: ReaderSource, modules: frozenset[str]) -> Iterator[ModelReader]:
    if source.declarations is not None:
        yield from _foreign_declarations(source)
        return
    kinds = frozenset(source.kinds)
    if source.drawn:
        kinds |= frozenset(VIEWS.values()) - _NOT_DRAWN
    reader = ModelReader(source.path)
    if source.text is not None:
        reader = read_code(source.path, source.text, modules)
    yield replace(
        reader,
        names=reader.names | frozenset(source.names),
        kinds=reader.kinds | kinds,
        opaque=source.opaque or reader.opaque,
    )


def _foreign_declarations(source: ReaderSource) -> Iterator[ModelReader]:
    """What the declarations of another model ask of the files that both share."""
    try:
        declarations = parse_declarations(source.path, source.declarations or "")
    except DeclarationError:
        yield ModelReader(source.path, opaque="it cannot be read")
        return
    yield from _declared_readers(declarations)
    keys = {scenario.keyframe for scenario in declarations.scenarios} - {None}
    names = frozenset(key for key in keys if isinstance(key, str))
    yield ModelReader(source.path, names, kinds=frozenset(["Keyframe"] if keys - names else []))


def _declared_readers(declarations: Declarations) -> list[ModelReader]:
    """What a file of declarations asks of a model."""
    scenarios = declarations.scenarios
    names = {s.observable.name for s in scenarios if s.observable is not None}
    fields = {"energy"} if any("energy" in (s.conserved or ()) for s in scenarios) else set()
    kinds: set[str] = set()
    swept = (part for sweep in declarations.sweeps for part in sweep.variations)
    for part in (*swept, *(part for scenario in scenarios for part in scenario.ranges)):
        things, _, field = part.parameter.rpartition(".")
        kind, _, name = things.partition(":")
        names |= {name} - {""}
        kinds |= set() if name else {VIEWS.get(kind, kind)}
        field = field.partition("[")[0]
        fields |= {field, "pos"} if field in _SHAPES else {field}
    words = frozenset(fields)
    path = declarations.path
    reader = ModelReader(path, frozenset(names), words, words, kinds=frozenset(kinds))
    return [reader] if names or fields else []
