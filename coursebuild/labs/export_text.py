"""The parts of an exported script that are the same for all labs, or only data.

Entry points: one function for each part, in the order in which a script has them. Each gives lines.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from coursebuild.labs.python_library import LIBRARY
from coursebuild.labs.python_values import NUMBERS, Type
from coursebuild.model import Lab, LabControl

_WIDTH = 88
_LONGEST = 100


class About(Struct, frozen=True):
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


DIVERGED = (
    "DIVERGED = (",
    "    mujoco.mjtWarning.mjWARN_BADQPOS,",
    "    mujoco.mjtWarning.mjWARN_BADQVEL,",
    "    mujoco.mjtWarning.mjWARN_BADQACC,",
    ")",
)
"""The warnings that end a run."""


def docstring(lab: Lab, about: About) -> list[str]:
    """What the script is and how to run it."""
    title = f"{plain(lab.title)}: " if lab.title else ""
    first = f"{title}{plain(about.origin)}, as a script."
    told = (
        f"From the course “{plain(about.course)}”, for MuJoCo {about.engine}. It starts and "
        "steps as the lab in the page does, with the controls as they were there, and prints "
        "the lab's readouts and the state at the end."
    )
    where, run = about.name, "Run it with:"
    if lab.xml is None:
        where = f"examples/{about.name}"
        run = f"The model is the course's: save this file as {where} there, and run it with:"
    text = [*textwrap.wrap(first, _WIDTH), "", *textwrap.wrap(told, _WIDTH)]
    text += ["", *textwrap.wrap(run, _WIDTH), "", f"    python {where}"]
    return ['"""' + text[0], *text[1:], '"""']


def imports(modules: Iterable[str], own_model: bool) -> list[str]:
    """Import statements in their usual order; `own_model`: the model is in the script."""
    wanted = {*modules, "import mujoco"}
    if "from dataclasses import field" in wanted:
        wanted -= {"from dataclasses import field", "from dataclasses import dataclass"}
        wanted.add("from dataclasses import dataclass, field")
    if any(line.startswith("from decimal import ") and "," in line for line in wanted):
        wanted.discard("from decimal import Decimal")
    engine = {line for line in wanted if "mujoco" in line or "numpy" in line}
    standard = sorted(wanted - engine, key=lambda line: (line.startswith("from"), line))
    lines = [*standard, *([""] if standard else []), *sorted(engine)]
    return lines if own_model else [*lines, "", "from mjcourse import model_path"]


def helpers(names: Iterable[str]) -> list[str]:
    """Names of the helpers that these need, themselves included, in order."""
    wanted, new = set[str](), set(names)
    while new:
        wanted |= new
        new = {need for name in new for need in LIBRARY[name].needs} - wanted
    return [name for name in LIBRARY if name in wanted]


def context_modules(context: Mapping[str, Type]) -> set[str]:
    """What the class of the context imports."""
    wanted = {"from dataclasses import dataclass"} if context else set()
    if any(type in NUMBERS for type in context.values()):
        wanted.add("import math")
    if "vector" in context.values():
        wanted |= {"import numpy as np", "from dataclasses import field"}
    return wanted


def context_class(context: Mapping[str, Type]) -> list[str]:
    """The class of what lab code keeps."""
    if not context:
        return []
    lines = ["", "", "@dataclass", "class Ctx:"]
    lines += ['    """What the lab\'s code keeps, under `ctx` there."""', ""]
    return lines + [f"    {name}: {_FIELDS[type]}" for name, type in sorted(context.items())]


def load(lab: Lab) -> list[str]:
    """Loading the model."""
    source = "from_xml_string(XML)"
    if lab.xml is None:
        source = f"from_xml_path(str(model_path({json.dumps(lab.model)})))"
    return [
        "",
        "",
        "def load() -> tuple[mujoco.MjModel, mujoco.MjData]:",
        '    """The model of the lab, and its data."""',
        f"    model = mujoco.MjModel.{source}",
        "    # MuJoCo would start again by itself where the motion diverges.",
        "    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET",
        "    return model, mujoco.MjData(model)",
    ]


_FIELDS: dict[Type, str] = {
    "num": "float = math.nan",
    "nat": "float = math.nan",
    "int": "float = math.nan",
    "bool": "bool = False",
    "str": 'str = ""',
    "vector": "np.ndarray = field(default_factory=lambda: np.zeros(0))",
}


def simulate(signature: str, args: str) -> list[str]:
    """Stepping, for as long as the build does."""
    lines = [
        "end = data.time + seconds",
        "while (end - data.time) / model.opt.timestep >= 0.5:",
        f"    step({args})",
        "    if any(data.warning[kind].number for kind in DIVERGED):",
        '        raise SystemExit(f"the motion diverged at t = {data.time:.6g} s")',
    ]
    told = "Whole steps for some simulated time."
    return function("simulate", f"{signature}, seconds: float = SECONDS", told, lines)


def current() -> list[str]:
    """What readouts look at, as in the page."""
    return [
        "",
        "",
        "def current(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:",
        '    """The same state in data of its own, with all that is derived from it up to date."""',
        "    signature = mujoco.mjtState.mjSTATE_INTEGRATION",
        "    state = np.empty(mujoco.mj_stateSize(model, signature))",
        "    mujoco.mj_getState(model, data, state, signature)",
        "    shown = mujoco.MjData(model)",
        "    mujoco.mj_setState(model, shown, state, signature)",
        "    mujoco.mj_forward(model, shown)",
        "    return shown",
    ]


def report(signature: str, args: str) -> list[str]:
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


def main(args: str, context: bool, buttons: Sequence[str]) -> list[str]:
    """Running all of it."""
    lines = ["model, data = load()"]
    lines += ["ctx = Ctx()"] if context else []
    lines += [f"start({args})"]
    if buttons:
        lines += ["# The lab's buttons; to press one, take its # away:"]
        lines += [f"# {name}({args})" for name in buttons]
    lines += [f"simulate({args})", f"report({args})"]
    run = ["", "", 'if __name__ == "__main__":', "    main()"]
    return [*function("main", "", "Run the lab.", lines), *run]


def function(
    name: str, signature: str, told: str, lines: Iterable[str], result: str = "None"
) -> list[str]:
    """A function of the script."""
    head = ["", "", f"def {name}({signature}) -> {result}:"]
    if len(head[-1]) > _LONGEST:
        head[-1:] = [f"def {name}(", f"    {signature}", f") -> {result}:"]
    return [*head, f'    """{told}"""', *(f"    {line}" for line in lines)]


def constant(i: int, name: str, control: LabControl, floating: bool) -> list[str]:
    """The value of a control, with what it is above it."""
    of = f" ({plain(control.unit)})" if control.unit else ""
    told = f"The control “{plain(control.label)}”{of}"
    if control.kind == "select":
        told += ", one of " + ", ".join(_option(label, v) for label, v in control.options)
    elif control.minimum is not None and control.maximum is not None:
        told += f", from {control.minimum:g} to {control.maximum:g}"
    value = f"{{{{control:{i}}}}}"
    lines = [f"# {line}" for line in textwrap.wrap(told, _WIDTH)]
    return [*lines, f"{name} = {f'float({value})' if floating else value}"]


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
