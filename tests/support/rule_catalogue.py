"""The catalogue of rules as a page of Markdown, each rule with an example.

Entry point: `catalogue_page(examples)`. The examples are the fixtures of the rules, so that the
page shows what the tool says and not what somebody thought it would say.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping

from msgspec import Struct

from coursebuild.core.text.rules import RULES, Rule

_LINES = 16
"""How much of a file an example shows."""
_LANGUAGES = {
    "json": "json",
    "md": "markdown",
    "py": "python fragment",
    "toml": "toml",
    "xml": "xml",
}


class ExampleFile(Struct, frozen=True):
    """A file of a course with a mistake."""

    path: str
    remark: str
    """What is said of it beside its path; may be empty."""
    text: str
    """Empty where there is nothing to show."""


class Example(Struct, frozen=True):
    """A mistake, and what its author is told."""

    command: str
    """`check`, or the command that finds it."""
    files: tuple[ExampleFile, ...]
    output: str


def catalogue_page(examples: Mapping[str, Example]) -> str:
    """`docs/reference/rules.md`."""
    errors = sum(rule.severity == "error" for rule in RULES.values())
    head = f"""\
# Rules

Every diagnostic of `coursebuild` names its rule, as in `error[output-drift]`. There are {errors}
errors and {len(RULES) - errors} warnings. An error keeps the site from being published, and
nothing silences it. A warning can be silenced in `content/course.toml`, by its rule and with a
reason:

```toml
[[silence]]
rule = "heading-skip"
reason = "the levels are those of the book"
path = "content/lessons/4.*"   # optional
```

{_contents("error")}

{_contents("warning")}
"""
    return head + "".join(_entry(rule, examples.get(name)) for name, rule in RULES.items())


def _contents(severity: str) -> str:
    names = [rule.name for rule in RULES.values() if rule.severity == severity]
    links = f"{severity.capitalize()}s: " + " · ".join(f"[`{name}`](#{name})" for name in names)
    return textwrap.fill(links, 120, break_on_hyphens=False)


def _entry(rule: Rule, example: Example | None) -> str:
    parts = [f"\n## {rule.name}\n\n{rule.severity.capitalize()}. {rule.summary}\n"]
    if example is None:
        return parts[0]
    for file in example.files:
        parts.append(f"\n`{file.path}`{file.remark}\n")
        if file.text:
            parts.append(f"\n{_fence(_LANGUAGES.get(file.path.rpartition('.')[2], ''), file.text)}")
    parts.append(f"\n`coursebuild {example.command}` says:\n\n{_fence('', example.output)}")
    return "".join(parts)


def _fence(kind: str, text: str) -> str:
    """A fence that no line of the text closes."""
    lines = text.rstrip("\n").split("\n")
    if len(lines) > _LINES and kind:
        lines = [*lines[:_LINES], "…"]
    body = "\n".join(lines)
    longest = max((len(run) for run in re.findall(r"`{3,}", body)), default=2)
    marks = "`" * (longest + 1)
    return f"{marks}{kind}\n{body}\n{marks}\n"
