"""The models of a course that can be measured, with what is declared for them.

Entry points: `find_scenes(root, names)`, `scene_digest`.

1. A scene is a file of `models/` that others do not include. One that is named is a scene in any
   case.
2. What does not compile, and what is declared wrongly, is a diagnostic; the other scenes are
   measured all the same.
3. Figures depend on the model with all files that it pulls in, on its scenarios, and on the file
   with its exact motion: the digest is theirs. It does not depend on the machine, nor on what else
   the file beside the model says.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from coursebuild.core.checks.compiled import (
    check_scenarios,
    diagnose_model,
    diagnose_orphan_scenarios,
)
from coursebuild.core.files.read import CourseFiles, read_course
from coursebuild.core.model import Declarations, MjcfModel
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.run.mjcf import compile_all, model_files, readable_error
from coursebuild.core.syntax.scenarios import parse_declarations
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Parsed,
    did_you_mean,
    nearest,
    sort_diagnostics,
)
from coursebuild.numerics.reports.cases import exact_file
from coursebuild.pipeline.options import UsageError

_PART = re.compile(r"\s*(?:<(?:\?.*?\?|!--.*?--)>\s*)*<mujocoinclude\b", re.DOTALL)


class CourseScene(Struct, frozen=True):
    """A model that can be measured."""

    model: MjcfModel
    declared: Declarations
    """What the file beside it says."""
    facts: ModelFacts
    digest: str
    """Of all that its figures depend on in the course."""

    @property
    def name(self) -> str:
        """Its file below `models/`, without suffix."""
        return self.model.name


def find_scenes(root: Path, names: tuple[str, ...] = ()) -> Parsed[tuple[CourseScene, ...]]:
    """The scenes that the names mean, by name; all where there are none.

    A name is that of a file below `models/`, with or without its suffix and folder.

    Raises:
        UsageError: no model is called so.
        EffectError: MuJoCo cannot be loaded.
    """
    read = read_course(root)
    models = {model.name: model for model in read.value.models}
    chosen = _named(names, models) if names else _whole(root, list(models.values()))
    declared, found = _declared(read.value, chosen, every=not names)
    found += [d for d in read.diagnostics if d.span.path.startswith("models/")]
    scenes: list[CourseScene] = []
    results = compile_all(root, [(model.source.path, model.source.text) for model in chosen])
    for model, result in zip(chosen, results, strict=True):
        if result.facts is None:
            found.append(diagnose_model(model, result, readable_error))
            continue
        says = declared.get(model.name, Declarations(model.name, model.source))
        if says is None:
            continue  # what is beside it cannot be read, and was told
        wrong = list(check_scenarios(says, result.facts))
        found += wrong
        if not wrong:
            scenes.append(CourseScene(model, says, result.facts, scene_digest(root, model, says)))
    return Parsed(tuple(scenes), sort_diagnostics(found))


def scene_digest(root: Path, model: MjcfModel, declared: Declarations) -> str:
    """Of a model with the files that it pulls in, and of its scenarios."""
    digest = hashlib.sha256()

    def add(*parts: bytes) -> None:
        for part in parts:
            digest.update(b"%d:" % len(part) + part)

    add(model.source.text.encode("utf-8", "surrogatepass"))
    for path in model_files(root, model.source.path, model.source.text):
        file = root / path
        if file.is_file():
            # A file elsewhere has another path on another machine.
            shown = path if not path.startswith("/") else f"/{file.name}"
            add(shown.encode("utf-8", "surrogateescape"), _content(file))
    exact = root / exact_file(model.name)
    if exact.is_file():
        add(exact.name.encode("utf-8", "surrogateescape"), _content(exact))
    add(_said(declared).encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def _content(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return b"unreadable"


def _said(declared: Declarations) -> str:
    """All that is declared and changes a figure, wherever it stands in the file.

    Recorded reports hold the digest of this text: said otherwise, none of them would fit any more.
    """
    bench = declared.bench
    parts = [f"Visible(share={bench.visible}, angle={bench.visible_angle})"]
    for one in declared.scenarios:
        said = (
            *(one.name, one.title or "", one.keyframe, one.qpos, one.qvel, one.duration),
            *(one.sample, one.controls, one.hold, one.observable),
            *(None if one.closed_form else one.reference, one.closed_form),
            *(one.conserved, one.timesteps),
        )
        parts.append(repr(said))
    for sweep in declared.sweeps:
        vary = [(one.parameter, one.values, one.relative) for one in sweep.variations]
        parts.append(repr((sweep.name, sweep.title or "", sweep.scenario or "", vary, sweep.show)))
    return f"[{', '.join(parts)}]"


# --- which


def _named(names: Sequence[str], models: dict[str, MjcfModel]) -> list[MjcfModel]:
    wanted: set[str] = set()
    for name in names:
        bare = name.removeprefix("./").removeprefix("models/")
        found = next((n for n in (name, bare, bare.removesuffix(".xml")) if n in models), None)
        if found is None:
            near = nearest(bare.removesuffix(".xml"), models)
            help = f"did you mean `{near}`?" if near is not None else did_you_mean("", models)
            raise UsageError(f"no model is called `{name}`", help=help)
        wanted.add(found)
    return [models[name] for name in sorted(wanted)]


def _whole(root: Path, models: Sequence[MjcfModel]) -> list[MjcfModel]:
    """Those that are no parts of others."""
    parts = {
        path for model in models for path in model_files(root, model.source.path, model.source.text)
    }
    return [m for m in models if m.source.path not in parts and not _PART.match(m.source.text)]


# --- what is wrong


def _declared(
    files: CourseFiles, chosen: Sequence[MjcfModel], *, every: bool
) -> tuple[dict[str, Declarations | None], list[Diagnostic]]:
    """What is declared for the chosen models; `None` for what cannot be understood."""
    wanted = {model.name for model in chosen}
    declared: dict[str, Declarations | None] = {}
    found: list[Diagnostic] = []
    paths = {model.source.path for model in files.models}
    for source in files.declarations:
        name = source.path.removeprefix("models/").removesuffix(".toml")
        if name in wanted:
            parsed = parse_declarations(source)
            declared[name] = parsed.value
            found += parsed.diagnostics
        elif every and f"models/{name}.xml" not in {*paths, *files.unreadable}:
            found.append(diagnose_orphan_scenarios(source, paths))
    return declared, found
