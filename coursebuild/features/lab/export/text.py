"""The parts of an exported script that are the same for all labs, or only data.

Entry points: one function for each part, in the order in which a script has them.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from coursebuild.features.lab.export.values import Code, Type
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.schema import Select, Slider

_WIDTH = 88
_LONGEST = 100


class ExportMetadata(Struct, frozen=True):
    """What a script says of where it comes from, and how long it runs."""

    name: str
    """Of the file: `lab_4_2_1.py`."""
    origin: str
    """For people: `a lab of lesson 4.2, “Mass and inertia”`."""
    course: str
    engine: str
    """Version of MuJoCo."""
    seconds: float
    """Simulated time."""


DIVERGED = """DIVERGED = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)"""
"""The warnings that end a run."""

CURRENT = '''def current(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """The same state in data of its own, with all that is derived from it up to date."""
    signature = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, signature))
    mujoco.mj_getState(model, data, state, signature)
    shown = mujoco.MjData(model)
    mujoco.mj_setState(model, shown, state, signature)
    mujoco.mj_forward(model, shown)
    return shown'''
"""What readouts look at, as in the page."""

_FIELDS: dict[Type, str] = {
    "num": "float = math.nan",
    "nat": "float = math.nan",
    "int": "float = math.nan",
    "bool": "bool = False",
    "str": 'str = ""',
    "vector": "np.ndarray = field(default_factory=lambda: np.zeros(0))",
}


def docstring(lab: Lab, metadata: ExportMetadata) -> list[str]:
    """What the script is and how to run it."""
    title = f"{plain(lab.fields.title)}: " if lab.fields.title else ""
    first = f"{title}{plain(metadata.origin)}, as a script."
    about = (
        f"From the course “{plain(metadata.course)}”, for MuJoCo {metadata.engine}. It starts and "
        "steps as the lab in the page does, with the controls as they were there, and prints "
        "the lab's readouts and the state at the end."
    )
    where, run = metadata.name, "Run it with:"
    if lab.xml is None:
        where = f"examples/{metadata.name}"
        run = f"The model is the course's: save this file as {where} there, and run it with:"
    text = [*textwrap.wrap(first, _WIDTH), "", *textwrap.wrap(about, _WIDTH)]
    text += ["", *textwrap.wrap(run, _WIDTH), "", f"    python {where}"]
    return ['"""' + text[0], *text[1:], '"""']


def constant(i: int, value: Code, control: Slider | Select) -> list[str]:
    """The value of a control, with what it is above it."""
    of = f" ({plain(control.unit)})" if control.unit else ""
    doc = f"The control “{plain(control.label)}”{of}"
    if isinstance(control, Select):
        doc += ", one of " + ", ".join(_option(label, v) for label, v in control.options)
    else:
        doc += f", from {control.min:g} to {control.max:g}"
    place = f"{{{{control:{i}}}}}"
    lines = [f"# {line}" for line in textwrap.wrap(doc, _WIDTH)]
    return [*lines, f"{value.text} = {f'float({place})' if value.type == 'num' else place}"]


def context_class(context: Mapping[str, Type]) -> list[str]:
    """The class of what lab code keeps, if it keeps anything."""
    if not context:
        return []
    fields = (f"    {name}: {_FIELDS[type]}" for name, type in sorted(context.items()))
    doc = '    """What the lab\'s code keeps, under `ctx` there."""'
    return ["\n".join(["@dataclass", "class Ctx:", doc, "", *fields])]


def load(lab: Lab) -> str:
    """Loading the model."""
    source = "from_xml_string(XML)"
    if lab.xml is None:
        source = f"from_xml_path(str(model_path({json.dumps(lab.fields.model)})))"
    lines = [
        f"model = mujoco.MjModel.{source}",
        "# MuJoCo would start again by itself where the motion diverges.",
        "model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET",
        "return model, mujoco.MjData(model)",
    ]
    result = "tuple[mujoco.MjModel, mujoco.MjData]"
    return function("load", "", "The model of the lab, and its data.", lines, result)


def simulate(signature: str, args: str) -> str:
    """Stepping, for as long as the build does."""
    lines = [
        "end = data.time + seconds",
        "while (end - data.time) / model.opt.timestep >= 0.5:",
        f"    step({args})",
        "    if any(data.warning[kind].number for kind in DIVERGED):",
        '        raise SystemExit(f"the motion diverged at t = {data.time:.6g} s")',
    ]
    doc = "Whole steps for some simulated time."
    return function("simulate", f"{signature}, seconds: float = SECONDS", doc, lines)


def report(signature: str, args: str) -> str:
    """Printing what came out."""
    lines = [
        f"for label, value, digits in readouts({args}):",
        '    text = value if isinstance(value, str) else f"{value:.{digits}f}"',
        '    print(f"{label}: {text}")',
        'print(f"time: {data.time:.6g} s")',
        'print("qpos:", data.qpos.tolist())',
        'print("qvel:", data.qvel.tolist())',
    ]
    return function("report", signature, "Print the readouts and the state.", lines)


def main(args: str, context: bool, buttons: Sequence[str]) -> str:
    """Running all of it."""
    lines = ["model, data = load()"]
    lines += ["ctx = Ctx()"] if context else []
    lines += [f"start({args})"]
    if buttons:
        lines += ["# The lab's buttons; to press one, take its # away:"]
        lines += [f"# {name}({args})" for name in buttons]
    lines += [f"simulate({args})", f"report({args})"]
    return function("main", "", "Run the lab.", lines)


def function(
    name: str, signature: str, doc: str, lines: Iterable[str], result: str = "None"
) -> str:
    """A function of the script."""
    head = [f"def {name}({signature}) -> {result}:"]
    if len(head[0]) > _LONGEST:
        head = [f"def {name}(", f"    {signature}", f") -> {result}:"]
    return "\n".join([*head, f'    """{doc}"""', *(f"    {line}" for line in lines)])


def _option(label: str, value: float | str) -> str:
    written = json.dumps(value) if isinstance(value, str) else number(value)
    return written if plain(label) == written else f"{written} ({plain(label)})"


def plain(text: str) -> str:
    """A text of the author in one line, for a comment."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(shown.replace("\\", "/").replace('"', "'").split())


def number(value: float) -> str:
    """A number without `.0`."""
    return str(int(value)) if value == int(value) else repr(value)


def long_text(text: str) -> str:
    """A text of several lines as Python writes it."""
    odd = any(not c.isprintable() and c != "\n" for c in text)
    if "\\" in text or '"""' in text or odd or text.endswith('"'):
        return repr(text)
    return f'"""\\\n{text}"""'
