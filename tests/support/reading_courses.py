"""The courses of the tests of reading: one of what is hard to fit, one in text from the right."""

from __future__ import annotations

from pathlib import Path

from support.scratch_course import Folder

LONG = "Donaudampfschifffahrtselektrizitätenhauptbetriebswerkbauunterbeamtengesellschaft"
URL = "https://example.org/a/very/long/address/that/cannot/be/broken/" + "x" * 120
CODE = "model.opt.integrator=mujoco.mjtIntegrator.mjINT_IMPLICITFAST;" * 3
WIDE = r"a_1 + a_2 + a_3 + a_4 + a_5 + a_6 + a_7 + a_8 + a_9 = \frac{\partial^2 u}{\partial x^2}"
MATRIX = r"\begin{pmatrix}" + r"\\".join(["&".join(["1000000"] * 9)] * 3) + r"\end{pmatrix}"

FUNCTIONS = "".join(
    f"def f{n}(x: float) -> float:\n    # {n}\n    return one(x) + {n}\n\n\n" for n in range(14)
)

NASTY = f"""## {LONG} and `{CODE}` in a heading

A long word, {LONG}, and a long piece of code, `{CODE}`, and a formula, ${WIDE}$, in a line.
An address: <{URL}>, and [one]({URL}) with a text. A matrix in a line: ${MATRIX}$.
It weighs 5 kg and falls at -9.81 m/s².[^one] Again.[^one] And on.[^blocks]

$$
{WIDE} + {WIDE} = {WIDE}
$$

| A | {LONG} | C | D | E |
| --- | ---: | :---: | --- | --- |
| `{CODE}` | -1.5[^table] | ${WIDE}$ | {URL} | e |
| a | b | c | d | e |

> [!established] {LONG} in a `{CODE}` title
> Text.[^callout]
>
> - One
>   1. Two
>      - Three `{CODE}`
>        - Four {LONG}
>
>          $$
>          {MATRIX}
>          $$
>
>          ```text
>          {"wide " * 60}
>          ```

> [!derivation]- Folded
> Hidden at first.[^folded]
>
> > A quotation with {LONG}
> >
> > | a | b |
> > | --- | --- |
> > | {LONG} | {LONG} |

- [ ] {LONG}
- [x] done

```python file=examples/sub/wide.py
\"\"\"A script that is long enough to be folded.\"\"\"

import math

WIDE = "{"=" * 150}"


def one(x: float) -> float:
    \"\"\"One.\"\"\"
    return math.sqrt(x)


{FUNCTIONS}print(WIDE)
print(f1(4.0))
```

Output:

```text digits
{"=" * 150}
3.0
```

The second line is `3.0`{{out=examples/sub/wide.py}} m/s, printed by [its last line](#sub/wide.L81).

```mjcf fragment=worldbody
<body name="{LONG}"><geom size="0.1 0.2 0.{"3" * 90}" type="box"/></body>
```

```io
INPUT: {LONG} `{CODE}`
PROCESS: ${WIDE}$
OUTPUT: {URL}
```

> [!solution] Code
> Words of a solution, which keep to the column of the text however long they are, as they do here.
>
> ```text
> {"code " * 30}
> ```

- A line with $\\sqrt u$, $x$ and $\\omega/2$.
- A line without.

## Lab

Before the lab.[^dock]

```lab simlab
{{"title": "{LONG}", "model": "box", "dock": true, "note": "`{CODE}`",
 "controls": [{{"label": "{LONG}", "unit": "kg", "min": 0, "max": 1, "value": 0, "param": "m"}}],
 "readouts": [{{"label": "{LONG} (J)", "expr": "1"}}],
 "plots": [{{"ylabel": "{LONG}", "traces": [{{"label": "{LONG}", "expr": "data.qpos[2]"}}]}}]}}
```

After the lab.

```quiz
{{"id": "q", "title": "{LONG}", "questions": [
 {{"kind": "mcq", "q": "Which? `{CODE}`", "options": ["{LONG}", "b"], "answer": 1,
  "explain": "{URL}", "hints": ["{LONG}"], "feedback": ["No: {LONG}.", "Yes."]}},
 {{"kind": "numeric", "q": "How much is ${WIDE.replace(chr(92), chr(92) * 2)}$?", "answer": 1,
  "unit": "kg m^2", "explain": "So."}},
 {{"kind": "order", "q": "Sort.", "items": ["{LONG}", "`{CODE}`", "c"], "explain": "So."}}]}}
```

## The end

{"A paragraph of some length, so that there is room. " * 20}Last.[^last]

[^one]: A note that is referred to twice, with {LONG} and `{CODE}`.

[^blocks]: A note of several blocks.

    - a list
    - of two

    ```python
    code = "{"x" * 80}"
    ```

[^table]: A note from a table.

[^callout]: A note from a callout.

[^folded]: A note whose mark is folded away.

[^dock]: A note beside a lab.

[^last]: The last note. {"It is long. " * 40}
"""

BOX = """<mujoco>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="box" pos="0 0 1"><freejoint/><geom type="box" size="0.2 0.1 0.05"/></body>
  </worldbody>
</mujoco>
"""


def course_map(title: str, language: str, base_url: str) -> str:
    """A course of one written and one planned lesson."""
    base = f'base_url = "{base_url}"' if base_url else ""
    return f"""[course]
title = "{title}"
summary = "{title} {LONG}"
language = "{language}"
{base}

[[page]]
id = "about"
title = "{title}"
file = "content/pages/about.md"

[[level]]
id = "1"
title = "{title}"
summary = "{title}"

[[level.lesson]]
id = "1.1"
slug = "one"
title = "{title}"
status = "complete"
summary = "{title} -10 m"
objectives = ["{title}", "-3 m/s"]
minutes = 3

[[level.lesson]]
id = "1.2"
slug = "two"
title = "{title}"
status = "planned"
prerequisites = ["1.1"]
"""


ARABIC = r"""## الفكرة الأساسية

تسارع الجاذبية -9.81 m/s² تقريبًا.[^1] المسافة $s = \frac12 g t^2$ والدالة `mj_step(model, data)`.

$$
E = \tfrac12 m v^2
$$

> [!established] أين تُحفظ الكتلة
> القيمة -0.5 و *انتبه* إلى [الصفحة](page:about).

| المقدار | القيمة |
| --- | --- |
| الكتلة | -2.5 kg |

```python file=examples/falling.py
print("t =", 1.25, "s")
```

Output (الناتج):

```text
t = 1.25 s
```

الزمن `1.25`{out=examples/falling.py} s.

```lab simlab
{"title": "صندوق", "model": "box", "dock": true,
 "readouts": [{"label": "الارتفاع", "expr": "data.qpos[2]"}]}
```

بعد المختبر.

## النهاية

هذا كل شيء.

[^1]: حاشية.
"""


def build(
    folder: Folder,
    stores: Path,
    text: str,
    title: str,
    language: str,
    base_url: str = "https://example.org/c/",
) -> Path:
    """A course of one lesson, built; gives the folder of its site."""
    folder.write("content/course.toml", course_map(title, language, base_url))
    folder.borrow(stores)
    folder.write("content/lessons/1.1-one.md", text)
    folder.write("content/pages/about.md", f"{title}\n")
    folder.write("models/box.xml", BOX)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder.root / "public"
