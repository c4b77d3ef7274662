"""A course with every kind of question, and everything that can stand in one."""

from __future__ import annotations

import json
from typing import Any

from support.fixture_cases import fixture_text
from support.scratch_course import Folder

SCRIPT = "```python file=examples/fall.py\nprint('drift  +6.6 %')\nprint('<b>&amp;')\n```\n\n"
MODEL = fixture_text("documents/zoo_model.xml")
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="4" height="4"><circle r="4"/></svg>'
SIM = {
    "title": "Fall", "model": "ball", "controls": [],
    "readouts": [{"label": "z", "expr": "data.qpos[2]"}],
}  # fmt: skip


def quiz(id: str, *questions: dict[str, Any], title: str = "Check") -> str:
    data = {"id": id, "title": title, "questions": list(questions)}
    return f"```quiz\n{json.dumps(data, ensure_ascii=False)}\n```\n\n"


RICH = (
    "A *text* with $x^2$ and **more**: `a < b`.\n\n$$\\frac{1}{2}\\begin{pmatrix}a&b\\\\c&d"
    "\\end{pmatrix}$$\n\n| one | two |\n|:---:|---:|\n| $\\vec a$ | 2 |\n\n```python\nif x < 1:\n"
    "    y = '&'\n```\n\n- [x] done\n- [ ] not\n\n1. a\n2. b\n\n> quoted\n\n"
    "![A square](sketch.svg)\n"
)
ANY: dict[str, dict[str, Any]] = {
    "mcq": {
        "kind": "mcq", "q": RICH, "options": ["$1$ < 2", "**two**", "`three`"], "answer": 1,
        "explain": RICH, "hints": ["First $y$.", "Second."], "feedback": ["No.", "", RICH],
    },
    "several": {
        "kind": "mcq", "q": "All?", "options": ["a", "b", "c"], "answer": [0, 2], "explain": "E."
    },
    "predict": {
        "kind": "predict", "q": "Where?", "options": ["up", "down"], "answer": 1, "sim": SIM,
    },
    "numeric": {
        "kind": "numeric", "q": "How much?", "answer": 0.08, "tol": 1e-4, "unit": "kg m^2"
    },
    "zero": {"kind": "numeric", "q": "Nothing?", "answer": -0.0, "tol": 0.5},
    "large": {"kind": "numeric", "q": "Large?", "answer": 6.02e23},
    "output": {"kind": "output", "q": "What?", "of": "examples/fall.py", "line": 1},
    "marks": {"kind": "output", "q": "Marks?", "of": "examples/fall.py", "line": 2},
    "open": {"kind": "open", "q": "Why?", "reference": RICH, "explain": "Because."},
    "order": {"kind": "order", "q": "In order.", "items": ["first", "*second*", "$3$", "fourth"]},
}  # fmt: skip


def furnish(folder: Folder) -> None:
    folder.write("models/ball.xml", MODEL)
    folder.write("content/lessons/sketch.svg", SVG)
