"""Work–precision plots as files of their own.

Entry point: `write_plots(file, scenes)`.

One scenario goes into the file that was named. Where there are several, the name of each stands
before its suffix: `plot.svg` becomes `plot-arm-swing.svg`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from coursebuild.effects.errors import EffectError, reason
from coursebuild.effects.write import write_atomic
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport
from coursebuild.numerics.reports.plot import plot_svg
from coursebuild.pipeline.options import UsageError

_SUFFIX = ".svg"


def plot_file(text: str) -> Path:
    """The file that `--plot` names.

    Raises:
        UsageError: it names none that a plot can go into.
    """
    path = Path(text)
    if path.suffix.lower() != _SUFFIX:
        raise UsageError(f"--plot: {text!r} is no name of an SVG file: plot.svg")
    if not path.absolute().parent.is_dir():
        raise UsageError(f"--plot: there is no folder {path.parent}")
    return path.absolute()


def write_plots(file: Path, scenes: Sequence[SceneReport]) -> tuple[str, ...]:
    """Draw every scenario; what was written, in words.

    Raises:
        UsageError: it cannot be written.
    """
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
