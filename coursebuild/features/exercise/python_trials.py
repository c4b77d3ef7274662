"""The trials of an exercise in Python, in a file that readers run on machines of their own.

The file is the script of the exercise's lab, with what the reader writes as at the start, and with
the trials as functions that `pytest` finds. It is run as a reader would run it, in an empty folder,
with the solution, which has to pass, and with the start, of which it has to say what the page says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import partial

import msgspec
from msgspec.structs import replace

from coursebuild.api import Trial, TrialContext
from coursebuild.core.run.alone import AloneJob, Runner
from coursebuild.core.values import fingerprint
from coursebuild.features.exercise.model import CONTROLLER, FORMULA, MATHS, MODEL, Exercise
from coursebuild.features.lab.engines.native import (
    LAB_ENGINE,
    NativeEngine,
    lab_digest,
)
from coursebuild.features.lab.export.script import (
    Export,
    ExportMetadata,
    LabExport,
    export_metadata,
    export_script,
    kept_export,
)
from coursebuild.features.lab.model import Test, Writing

_SUBJECTS = {MODEL: "XML", CONTROLLER: "control", FORMULA: "answer"}
"""What a reader writes, as it is called in the file."""


def export_exercise(
    context: TrialContext,
    native: NativeEngine,
    trial: Trial,
    exercise: Exercise,
    files: Mapping[str, bytes],
    start: Sequence[bool],
) -> LabExport:
    """Write and try the file of an exercise, or take it from the store.

    `files` are those of the model by path, that of the model itself first; `start` says which
    trials the start passes in the page.
    """
    slug = re.sub(r"[^a-z0-9]+", "_", exercise.id.lower()).strip("_")
    metadata = export_metadata(context, trial, "an exercise", f"test_{slug}.py", 0)
    code = lab_digest(".", "export/script.jinja")
    texts = (exercise.solution.text, exercise.lab.config, exercise.lab.fields)
    key = fingerprint((code, exercise.data(), texts, metadata, {**files}, tuple(start)))
    write = partial(_try, context, native, exercise, metadata, files, start)
    return kept_export(context.run_store.store, key, write)


def _try(
    context: TrialContext,
    native: NativeEngine,
    exercise: Exercise,
    metadata: ExportMetadata,
    files: Mapping[str, bytes],
    start: Sequence[bool],
) -> LabExport:
    limits, count = context.course.limits, len(exercise.trials)
    jobs: list[AloneJob] = []
    for text in (exercise.solution.text, exercise.start.text):
        export = _write(native, exercise, metadata, files, text)
        if isinstance(export, str):
            return LabExport(None, export)
        job = AloneJob(
            files=((export.name, export.text.encode()),),
            path=export.name,
            arguments=(),
            figures=(),
            modules=("mujoco", "numpy"),
            packages=(f"mujoco=={LAB_ENGINE}",),
            environment=(),
            timeout=limits.lab * count,
            memory=limits.scripts,
        )
        jobs.append(job)
    store = context.run_store.store
    runner = Runner(context.root, store, native.interpreter, context.sandbox, 1)
    for run, verdicts in zip(runner.run(jobs), ([True] * count, list(start)), strict=True):
        lines = re.findall(r"^(passed|failed): (.*)", run.stdout, re.MULTILINE)
        if len(lines) != count:
            return LabExport(None, f"its file fails in an empty folder: {run.failure}")
        for (verdict, line), expected in zip(lines, verdicts, strict=True):
            if (verdict == "passed") is not expected:
                reason = f"its file judges otherwise than the page: {verdict}: {line}"
                return LabExport(None, reason)
    ((name, data),) = jobs[1].files
    return LabExport((name, data.decode()))


def _write(
    native: NativeEngine,
    exercise: Exercise,
    metadata: ExportMetadata,
    files: Mapping[str, bytes],
    text: str,
) -> Export | str:
    """The file with a text in the place of what the reader writes; or why there is none."""
    lab = exercise.lab
    formula: tuple[str, ...] = ("",)
    if exercise.subject == MODEL:
        files = {path: text.encode() for path in files}
    elif exercise.subject == CONTROLLER:
        lab = replace(lab, fields=replace(lab.fields, controller=text))
    else:
        lab = replace(lab, fields=replace(lab.fields, setup=exercise.setup))
        formula = (*exercise.names, _with_maths(text, exercise.names))
    tests = msgspec.convert(exercise.trials, tuple[Test, ...], from_attributes=True)
    writing = Writing(_SUBJECTS[exercise.subject], tests, formula)
    return export_script(lab, metadata, native.description, files, writing)


def _with_maths(formula: str, variables: Sequence[str]) -> str:
    """A formula as the code of labs has it, in which functions belong to `Math`."""
    names = [name for name in MATHS.split() if name not in variables]
    text = re.sub(rf"(?<![\w.])({'|'.join(names)})\b", r"Math.\1", formula.replace("^", "**"))
    return text if "pi" in variables else re.sub(r"(?<![\w.])pi\b", "Math.PI", text)
