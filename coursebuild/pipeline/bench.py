"""`coursebuild bench`: speed against error of the course's models.

Entry points: `bench(options, names, quick=…)`, `record(…)`, `check(…)`; `write_plots(file, …)`.

1. Names mean models. One that does not compile is told, and the others are measured.
2. What was measured is kept under all that it depends on, a scenario at a time: a run that was
   stopped goes on where it was. Times say something of this machine only, so they are not shared.
3. One run of a course measures at a time, since two would disturb each other's times; the second
   finds what the first has measured.
4. `record` writes what was measured into `content/reports/`; `check` measures again, whatever is
   kept, and holds figures of accuracy against what is recorded there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model.scenarios import Bands
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport
from coursebuild.numerics.reports.departures import Checked, scene_departures
from coursebuild.numerics.reports.records import (
    BENCH,
    ReportFailure,
    bench_path,
    decode_bench,
    encode_bench,
)
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.reports import (
    Measurement,
    command,
    read_record,
    recorded_models,
    write_records,
)
from coursebuild.pipeline.scene_run import Measuring, SceneRun
from coursebuild.pipeline.scenes import CourseScene, Scenes, find_scenes


def bench(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    measuring: Measuring | None = None,
) -> Measurement[SceneReport]:
    """Measure the models that the names mean; all where there are none.

    Raises:
        UsageError: no model is called so.
    """
    return _measured(options, names, measuring, quick=quick)


def _measured(
    options: Options,
    names: tuple[str, ...],
    measuring: Measuring | None,
    *,
    quick: bool,
    cards: bool = False,
) -> Measurement[SceneReport]:
    found = find_scenes(options.root, names)
    run = SceneRun(options, measuring, quick=quick, cards=cards)
    reports = run.all(found.scenes)
    return Measurement(reports, sort_diagnostics((*found.diagnostics, *run.diagnostics)))


def record(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    measuring: Measuring | None = None,
) -> Measurement[SceneReport]:
    """Measure, and write each model's report into the course.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    _whole("--record", quick=quick)
    found = _measured(options, names, measuring, quick=False, cards=True)
    records = ((bench_path(one.model), encode_bench(one)) for one in found.reports)
    failures, remarks = write_records(options.root, records)
    return replace(found, failures=failures, remarks=remarks)


def check(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    measuring: Measuring | None = None,
) -> Measurement[SceneReport]:
    """Measure again, and hold it against what is recorded.

    A model without a recorded report, or with one that cannot be read, is not measured.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    _whole("--check", quick=quick)
    found = find_scenes(options.root, names)
    failures: list[ReportFailure] = []
    recorded: dict[str, SceneReport] = {}
    for scene in found.scenes:
        report, failure = _recorded(options, scene.name)
        if report is not None:
            recorded[scene.name] = report
        if failure is not None:
            failures.append(failure)
    run = SceneRun(options, measuring, quick=False, again=True)
    reports = run.all([scene for scene in found.scenes if scene.name in recorded])
    bands = {scene.name: _bands(scene) for scene in found.scenes}
    checked = [_checked(recorded[one.model], one, bands[one.model]) for one in reports]
    return Measurement(
        reports,
        sort_diagnostics((*found.diagnostics, *run.diagnostics)),
        tuple(checked),
        tuple(failures),
        () if names else _of_no_model(options, found),
    )


def _whole(option: str, *, quick: bool) -> None:
    if quick:
        raise UsageError(f"{option} takes no --quick: what is recorded is measured in full")


def _bands(scene: CourseScene) -> Bands:
    return Bands() if scene.declared is None else scene.declared.bands


def _recorded(options: Options, model: str) -> tuple[SceneReport | None, ReportFailure | None]:
    path, make = bench_path(model), command("bench", (model,), "--record")
    found, failure = read_record(options.root, path, decode_bench, make)
    if found is not None and found.model != model:
        why = f"{path} holds a report of the model `{found.model}`"
        return None, ReportFailure(why, f"make it again with `{make}`")
    if found is not None and found.quick:
        why = f"{path} holds a report of `{BENCH} --quick`, which measures only a part"
        return None, ReportFailure(why, f"make it again with `{make}`")
    return found, failure


def _checked(recorded: SceneReport, measured: SceneReport, bands: Bands) -> Checked:
    remarks = []
    if recorded.digest != measured.digest:
        remarks.append("the model or its scenarios have changed since it was recorded")
    for what, old, new in (
        ("MuJoCo", recorded.machine.engine, measured.machine.engine),
        ("NumPy", recorded.machine.numpy, measured.machine.numpy),
        ("Python", recorded.machine.python, measured.machine.python),
        ("", recorded.machine.system, measured.machine.system),
    ):
        if old != new:
            remarks.append(f"recorded with {what} {old}, measured with {new}".replace("  ", " "))
    departures = scene_departures(recorded, measured, bands)
    return Checked(measured.model, bench_path(measured.model), departures, tuple(remarks))


def _of_no_model(options: Options, found: Scenes) -> tuple[str, ...]:
    """Recorded reports that nothing is held against any more."""
    gone = sorted(recorded_models(options.root) - set(found.names))
    return tuple(f"{bench_path(name)} belongs to no model" for name in gone)


# ------------------------------------------------------------------------------------------- plots


def plot_file(text: str) -> Path:
    """The file that `--plot` names.

    Raises:
        UsageError: it names none that a plot can go into.
    """
    path = Path(text)
    if path.suffix.lower() != ".svg":
        raise UsageError(f"--plot: {text!r} is no name of an SVG file: plot.svg")
    if not path.absolute().parent.is_dir():
        raise UsageError(f"--plot: there is no folder {path.parent}")
    return path.absolute()


def write_plots(file: Path, scenes: Sequence[SceneReport]) -> tuple[str, ...]:
    """Draw every scenario in a file of its own; what was written, in words.

    One scenario goes into the file that was named. Where there are several, the name of each stands
    before its suffix: `plot.svg` becomes `plot-arm-swing.svg`.

    Raises:
        UsageError: it cannot be written.
    """
    from coursebuild.numerics.reports.plot import plot_svg

    found = [(scene, one) for scene in scenes for one in scene.scenarios]
    said = []
    for path, (scene, scenario) in zip(_names(file, found), found, strict=True):
        svg = plot_svg(scenario, name="plot", whole=True)
        if not svg:
            said.append(f"{scene.model}, {scenario.name}: there is no error to draw")
            continue
        try:
            before = path.read_bytes() if path.exists() else None
            data = svg.encode()
            write_atomic(path.parent, path.name, data, expected=before, durable=False)
        except EffectError as error:
            raise UsageError(f"--plot: {error.message}") from None
        except OSError as error:
            raise UsageError(f"--plot: {path} cannot be written: {reason(error)}") from None
        said.append(f"wrote {path.name}")
    return tuple(said)


def _names(file: Path, found: Sequence[tuple[SceneReport, ScenarioReport]]) -> Iterator[Path]:
    """A file for each scenario, no two the same."""
    taken: set[str] = set()
    for scene, scenario in found:
        name = file.stem
        if len(found) > 1:
            name += "-" + re.sub(r"[^\w.-]+", "-", f"{scene.model}-{scenario.name}")
        number, stem = 1, name
        while name.casefold() in taken:
            number += 1
            name = f"{stem}-{number}"
        taken.add(name.casefold())
        yield file.with_name(name + file.suffix)
