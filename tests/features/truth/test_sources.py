"""Numbers that are held against the labs and models of their lesson."""

from __future__ import annotations

from pathlib import Path

from coursebuild.features.truth.claims import check_sources, document_claims, unbound_results
from coursebuild.pipeline.load import load_course
from support.rule_cases import Layout

COURSE = """\
=== models/box.xml
<mujoco><worldbody><geom type="box" size="0.1 0.05 0.0217"/></worldbody></mujoco>
=== content/lessons/1.1-first.md
```lab simlab {#lab:box}
{"title": "Box", "model": "box", "note": "It turns with 6.25 rad/s.\\n\\n{given=\\"lab\\"}",
 "controls": [{"type": "button", "label": "Spin", "run": "data.qvel[3] = 6.25"}]}
```

```lab ode {#lab:fall}
title = "Fall"
t = {max = 2.5}
states = {v = {start = 0, rate = "-9.81"}}
```

A box of 20 × 10 cm turns with 6.25 rad/s, or falls with 9.81 m/s². {given="lab"}

It turns with 6.25 rad/s, and not for 2.5 s. {given="#lab:box"}

In 2.5 s it falls by more than 17.3 m; it is 0.1 m or 4.34 cm thick.
"""


def test_a_number_of_a_lab_is_in_it_or_in_its_model(tmp_path: Path) -> None:
    Layout.of(COURSE).write(tmp_path)
    course = load_course(tmp_path)
    document = course.documents[0]
    diagnostics = check_sources(course, [(document, document_claims(document))])
    assert [d.message for d in diagnostics] == ["`#lab:box` has no number `2.5`"]


def test_what_a_lab_or_its_model_holds_is_no_result(tmp_path: Path) -> None:
    Layout.of(COURSE).write(tmp_path)
    results = [c.text for _, claims in unbound_results(load_course(tmp_path)) for c in claims]
    assert results == ["17.3"]


MAP = """\
=== content/course.toml
[course]
title = "A course"

[[level]]
id = "1"
title = "Level"

[[level.lesson]]
id = "1.1"
slug = "first"
title = "Falls in 2.5 s"
summary = "From `17.3 m`{out=examples/fall.py} to 4.34 cm, in 3 steps."
status = "complete"
=== content/lessons/1.1-first.md
```python file=examples/fall.py
print("height 17.3 m")
```

It falls for 2.5 s. {given="a book"}
"""


def test_what_the_map_states_of_a_lesson_is_bound_or_listed(tmp_path: Path) -> None:
    Layout.of(MAP).write(tmp_path)
    results = [c.text for _, claims in unbound_results(load_course(tmp_path)) for c in claims]
    assert results == ["4.34"]


UNITS = """\
=== content/lessons/1.1-first.md
A ball rolls for 2.5 s at 0.5 m/s, for 35 days, by 0.3 in `steps` or 0.4 in $x$.

| length [cm] | count |
| --- | --- |
| 2.5 | 0.7 |

{given="a book"}
"""


def test_a_unit_ends_where_its_phrase_does(tmp_path: Path) -> None:
    """`s at` are no attoseconds, and `in` before code or a formula is a word."""
    Layout.of(UNITS).write(tmp_path)
    claims = document_claims(load_course(tmp_path).documents[0]).open
    values = {claim.text: claim.values[-1][0] for claim in claims}
    assert values == {"2.5": 2.5, "0.5": 0.5, "35": 35 * 86400, "0.3": 0.3, "0.4": 0.4}
