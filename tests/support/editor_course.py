"""A course that an editor has open: what its lessons refer to, and how it is served."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from support.editor import Editor
from support.scratch_course import Folder, wait_until_alone

FIRST_LESSON, SECOND_LESSON, MAP = (
    "content/lessons/1.1-one.md",
    "content/lessons/1.2-two.md",
    "content/course.toml",
)
FALL = """## Fall 🪂

The [moment of inertia]{term} weighs mass by its distance. Turning is $\\omega${symbol="angular
velocity" unit="rad/s"}, in $\\tfrac12 I \\omega^2$ too.

$$E = m g h$$ {#eq:energy}

```python file=examples/fall.py
import mujoco
from mjcourse import model_path

model = mujoco.MjModel.from_xml_path(str(model_path("ball")))
data = fall_data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(f"after {model.opt.timestep} s at {data.qpos[2]:.3f} m")
```

Output:

```text
after 0.002 s at 1.000 m
```

So it is at `1.000`{out} m, says `fall_data`.

> [!warning] Careful
> It falls.

```lab simlab
{"model": "ball",
 "title": "A ball",
 "readouts": [{"label": "height", "expr": "data.qpos[2]"}]}
```
"""
LINKS = """## Links

See [the ball](model:ball), [what turns](term:moment-of-inertia), [falling](lesson:1.1#fall),
[energy](lesson:1.1#eq:energy), [the script](examples/fall.py), Lesson 1.1 and [here](#links).
It calls `mj_step(model, data)`, reads `body_mass` and keeps `data`; `<joint damping="2"/>` is MJCF.
[](#tab:falls) is of [see @galilei1638, p. 3].

Table: Two *falls* {#tab:falls}

| height | time |
| ------ | ---- |
| 1      | 2    |
"""
SOURCES = """@book{galilei1638,
  author = {Galilei, Galileo},
  title = {Two new sciences},
  year = {1638},
  isbn = {978-3-16-148410-0},
}
"""
BALL = """<!-- A ball in the air. -->
<mujoco>
  <worldbody>
    <body pos="0 0 1"><freejoint/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""


def wait_for_results(editor: Editor) -> None:
    """Until everything has run."""
    editor.wait_for(lambda: "nq = 7" in editor.hover_text(SECOND_LESSON, "model:ba|ll"))


def open_course(folder: Folder, stores: Path) -> Iterator[Editor]:
    """An editor with all texts open, whose scripts have run; it ends with its server."""
    folder.write("models/ball.xml", BALL)
    folder.write("content/references.bib", SOURCES)
    folder.fill([FALL, LINKS], stores)
    editor = Editor(folder)
    for path in (FIRST_LESSON, SECOND_LESSON, MAP):
        editor.write(path, folder.text(path))
    editor.save(FIRST_LESSON)  # from now on scripts run
    wait_for_results(editor)
    yield editor
    status = editor.close()
    assert status == 0, status
    wait_until_alone(folder)
