"""Inputs as bytes: pages are drawn from what is read out of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.values import decode, encode, fingerprint

TEXT = """\
See [itself](lesson:1.1) and *terms*{term=spin}, by $x^2$.

```python
# examples/a.py
print(1)
```

```output
1
```
"""


def test_inputs_come_back_as_it_was(make: Callable[..., Any]) -> None:
    made = make(TEXT)
    library = Library.of(made.course, made.results, made.assets)
    kinds = set()
    for page in page_list(library):
        inputs = page.inputs(library)
        back = decode(encode(inputs), PageInputs)
        assert back == inputs
        # What it is made of is not the same objects: equal inputs have equal bytes.
        assert encode(back) == encode(inputs) == encode(page.inputs(library))
        assert fingerprint(back) == fingerprint(inputs)
        kinds.add(inputs.head.kind)
    assert {"home", "level", "lesson"} <= kinds
