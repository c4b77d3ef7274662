"""The course as another tool has it, to be imported: `course.json`, Markdown, models and figures.

Each lesson has, beside what all flavors share, some of the constructs that such courses hold.
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors import coursebuild
from benchmarks.generate.flavors.common import plain, write_text

CONSTRUCTS = (
    "![A ball above the ground](../images/ball.svg)",
    '<img src="../images/ball.svg" alt="A ball" width="80">',
    "It goes back to [the first lesson][first].\n\n[first]: #/lesson/{first}",
    "The next one is [here](#/lesson/{next}), [its end](#/lesson/{next}#the-end) later.",
    "The idea is old.[^old]\n\n[^old]: Older than the method.",
    "In one step it moves by $x_1 $ and \\(x_2\\).",
    "> [!established] Known\n> It keeps falling.\n\n> [!history] Galileo\n> He measured it.",
    '```lab simlab\n{{"title": "A ball", "model": "ball", "camera": {{"azimuth": 110, '
    '"elevation": 20, "distance": 3, "target": [0, 0, 0.5]}}}}\n```',
    '```mjcf fragment="worldbody"\n<body pos="0 0 1"><freejoint/><geom size="0.1"/></body>\n```',
    "```Python\nstep(model, data)\n```",
    "```python\n>>> 2 + 2\n4\n```",
    '```debug\n{{"broken": "data.qvel[3] = 0", "hint": "Which index is the height?"}}\n```',
    "```cpp\nmj_step(m, d);\n```",
    "[TOC]",
    "The measured times are in [a table](../data/times.csv).",
    "The model is `models/ball.xml`; Lesson {first} shows it.",
    "# A second part\n\n## In it\n\nIt goes on.",
    "<!-- a remark of the author -->\n\nThe end of a section.",
    "\\begin{{equation}}\nE = m g h\n\\end{{equation}}",
    "- [x] read\n- [ ] compute",
)
BALL = """<mujoco model="ball">
  <compiler meshdir="meshes"/>
  <asset><mesh name="stone" file="stone.obj"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="ball" pos="0 0 1"><freejoint/><geom size="0.05"/></body>
    <geom type="mesh" mesh="stone" pos="1 0 0"/>
  </worldbody>
</mujoco>
"""
STONE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
PICTURE = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 20">'
    '<circle cx="10" cy="6" r="3"/><path d="M0 18H20" stroke="black"/></svg>\n'
)
EACH = 4
"""Constructs in a lesson."""


def write(lessons: list[Lesson], folder: Path) -> None:
    """The map, the lessons but the last of each level, which is planned, and what they name."""
    levels: dict[str, list[dict[str, object]]] = {}
    for number, lesson in enumerate(lessons):
        following = lessons[(number + 1) % len(lessons)].id
        is_planned = number % 10 == 9
        entry = {
            "id": lesson.id,
            "slug": lesson.slug,
            "title": lesson.title,
            "summary": lesson.summary,
            "status": "stub" if is_planned else "done",
            "estimated_minutes": 40,
            "objectives": ["Say which method is exact"],
            "prerequisites": list(lesson.prerequisites),
        }
        levels.setdefault(lesson.id.split(".")[0], []).append(entry)
        if is_planned:
            continue
        pieces = [
            f"# {lesson.title}",
            *(
                plain(coursebuild.piece_text(piece, lesson), lambda id: f"#/lesson/{id}")
                for piece in lesson.pieces
            ),
        ]
        constructs = (CONSTRUCTS[(number * EACH + k) % len(CONSTRUCTS)] for k in range(EACH))
        extra = (text.format(first=lessons[0].id, next=following) for text in constructs)
        text = "\n\n".join((*pieces, "## More of it", *extra)) + "\n"
        write_text(folder / "content" / "lessons" / f"{lesson.name}.md", text)
    course_map = {
        "title": "Methods and their errors",
        "description": "Known solutions, four methods, and what each of them gets wrong.",
        "levels": [
            {
                "id": int(id),
                "title": f"Problems, part {id}",
                "checkpoint": "You can tell the methods apart.",
                "lessons": entries,
            }
            for id, entries in levels.items()
        ],
    }
    files = {
        "content/course.json": json.dumps(course_map, indent=1),
        "content/images/ball.svg": PICTURE,
        "content/data/times.csv": "step,time\n1,0.5\n",
        "models/ball.xml": BALL,
        "models/meshes/stone.obj": STONE,
    }
    for path, text in files.items():
        write_text(folder / path, text)
