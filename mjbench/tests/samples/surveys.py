"""Surveys of models given as texts; timed only where a test gives a clock."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import mujoco

from mjbench.costs import Clock
from mjbench.declarations import Declarations, parse_declarations
from mjbench.pruning.comparison import pruning_scenes
from mjbench.pruning.model_text import ModelText, open_model
from mjbench.pruning.readers import read_code
from mjbench.pruning.survey import Rerun, Survey, Surveyor
from mjbench.reports.diet_report import Finding, Keep
from samples.reports import MACHINE

PATH = "models/a.xml"
PENDULUM = """<body name="bob" pos="0 0 1"><joint name="pivot" axis="0 1 0"/>
      <geom name="ball" size=".05" pos=".3 0 0"/></body>"""


def scene(world: str = PENDULUM, *, head: str = "", rest: str = "") -> str:
    """The MJCF text of a model, over several lines."""
    return f"<mujoco>\n  {head}\n  <worldbody>\n    {world}\n  </worldbody>\n  {rest}\n</mujoco>\n"


def field(links: int, pieces: int) -> str:
    """An arm with sensors over a floor, and boxes at rest out of its reach."""
    inner = ""
    for i in reversed(range(links)):
        inner = f'''<body name="link{i}" pos="{0.2 if i else 0} 0 {0 if i else 2}">
      <joint name="joint{i}" axis="{("0 1 0", "0 0 1", "1 0 0")[i % 3]}" damping="0.5"/>
      <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.03"/>
      <site name="at{i}" pos="0.1 0 0"/>{inner}</body>'''
    boxes = "".join(
        f'<body pos="{20 + i % 8} {i // 8} 0.1"><freejoint/>'
        '<geom type="box" size="0.1 0.1 0.1"/></body>'
        for i in range(pieces)
    )
    sensors = "".join(
        f'<accelerometer site="at{i}"/><gyro site="at{i}"/><force site="at{i}"/>'
        f'<framepos objtype="site" objname="at{i}"/>'
        for i in range(links)
    )
    floor = '<geom type="plane" size="60 60 1"/>'
    return scene(floor + inner + boxes, rest=f"<sensor>{sensors}</sensor>")


def open_files(files: Mapping[str, str | bytes], path: str = PATH) -> ModelText:
    """Open a model from the given files."""
    data = {
        name: content.encode() if isinstance(content, str) else content
        for name, content in files.items()
    }

    def compile_files(files: Mapping[str, bytes]) -> mujoco.MjModel:
        return mujoco.MjModel.from_xml_path(path, data | files)

    return open_model(path, data.get, compile_files)


def parse_declared(text: str) -> Declarations:
    return parse_declarations("models/a.toml", text)


NO_DECLARATIONS = parse_declared("")


def run_survey(
    text: str | bytes | Mapping[str, str | bytes],
    *,
    lesson: str = "",
    keeps: Mapping[str, str] | None = None,
    declarations: Declarations = NO_DECLARATIONS,
    quick: bool = True,
    clock: Clock | None = None,
    rerun: Rerun | None = None,
    only: Collection[str] = (),
) -> Survey:
    """Survey a model, for `only` these kinds of findings; `lesson` is a script that uses it."""
    model = open_files(text if isinstance(text, Mapping) else {PATH: text})
    return Surveyor(
        model="a",
        digest="",
        machine=MACHINE,
        text=model,
        scenes=pruning_scenes(model.model, declarations, quick=quick),
        readers=(read_code("examples/a.py", lesson),) if lesson else (),
        keeps={
            key: Keep(key, reason, "models/a.toml", 1, 1) for key, reason in (keeps or {}).items()
        },
        locked={},
        clock=clock,
        quick=quick,
        tell=lambda _: None,
        rerun=rerun,
        only=only,
    ).survey()


def findings_by_kind(survey: Survey) -> dict[str, Finding]:
    """The findings by kind."""
    findings = {finding.kind: finding for finding in survey.report.findings}
    assert len(findings) == len(survey.report.findings)
    return findings


def names(finding: Finding) -> list[str]:
    return [place.name for place in finding.places]


def fixed_text(survey: Survey, path: str = PATH) -> str:
    files = {content.path: content.data for content in survey.text.documents}
    return (files | survey.text.files(survey.edits))[path].decode()
