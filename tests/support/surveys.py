"""Surveys of models given as texts; nothing is timed but where a test gives a clock."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from coursebuild.core.model.scenarios import Declarations
from coursebuild.numerics.pruning.ablation import Order, Survey, survey
from coursebuild.numerics.pruning.compare import pruning_scenes
from coursebuild.numerics.pruning.model_text import ModelText, open_model
from coursebuild.numerics.pruning.readers import Reader, Readers
from coursebuild.numerics.reports.diet import Finding
from coursebuild.numerics.timing import Clock

PATH = "models/a.xml"
PENDULUM = """<body name="bob" pos="0 0 1"><joint name="pivot" axis="0 1 0"/>
      <geom name="ball" size=".05" pos=".3 0 0"/></body>"""


def scene(world: str = PENDULUM, *, head: str = "", rest: str = "") -> str:
    """A model, laid out over lines."""
    return f"<mujoco>\n  {head}\n  <worldbody>\n    {world}\n  </worldbody>\n  {rest}\n</mujoco>\n"


def opened(files: Mapping[str, str | bytes], path: str = PATH) -> ModelText:
    """A model whose files are given; assets are found by their names."""
    data = {name: one.encode() if isinstance(one, str) else one for name, one in files.items()}
    assets = {name.rpartition("/")[2]: one for name, one in data.items() if name != path}

    def compiled(text: bytes) -> mujoco.MjModel:
        return mujoco.MjModel.from_xml_string(text.decode("utf-8-sig"), assets)

    return open_model(path, data.get, compiled)


def tried(
    text: str | bytes | Mapping[str, str | bytes],
    *,
    lesson: str = "",
    keeps: Mapping[str, str] | None = None,
    locked: Mapping[str, str] | None = None,
    numbered: frozenset[str] = frozenset(),
    declared: Declarations | None = None,
    quick: bool = True,
    clock: Clock | None = None,
) -> tuple[ModelText, Survey]:
    """The model, and what was found in it; `lesson` is what the course says of it."""
    model = opened(text if isinstance(text, Mapping) else {PATH: text})
    order = Order(
        model,
        pruning_scenes(model.model, declared, quick=quick),
        Readers((Reader("content/lessons/1.1-a.md", lesson),) if lesson else ()),
        keeps or {},
        locked or {},
        numbered,
        clock,
        quick,
        lambda _: None,
    )
    return model, survey(order)


def found(survey: Survey) -> dict[str, Finding]:
    """Findings that are no settings, by kind."""
    kinds = [one.kind for one in survey.findings if not one.setting]
    assert len(set(kinds)) == len(kinds)
    return {one.kind: one for one in survey.findings if not one.setting}


def names(finding: Finding) -> list[str]:
    """What a finding is about."""
    return [place.name for place in finding.places]


def fixed(model: ModelText, survey: Survey, path: str = PATH) -> str:
    """The file after all that is bit-identical was changed."""
    files = model.files(survey.edits)
    data = files.get(path)
    if data is None:
        data = next(one.data for one in model.documents if one.path == path)
    return data.decode()
