"""Each rule that parsing Markdown can raise is seen in a fixture, with the exact words."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import coursebuild.core.syntax
from coursebuild.core.text.rules import RULES

FIXTURES = Path(__file__).parents[2] / "fixtures" / "syntax"
PACKAGE = Path(coursebuild.core.syntax.__file__).parent
IO = PACKAGE.parents[1] / "features" / "io" / "parse"
MODULES = [
    *("bench", "block_parser", "callout", "dispatch", "document", "fence", "footnotes"),
    *("headings", "html", "info", "inline_parser", "inlines", "math", "mention", "mjcf"),
    *("recording", "script", "session", "spans", "tables", "targets", "tree"),
]


def raised() -> set[str]:
    """The names of rules that stand in calls of `diagnose`."""
    found = set()
    for module in (*MODULES, IO):
        for node in ast.walk(ast.parse((PACKAGE / f"{module}.py").read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "diagnose":
                rule = node.args[0]
                assert isinstance(rule, ast.Constant), f"{module}: a rule is not written out"
                found.add(str(rule.value))
    return found


def test_each_rule_is_in_a_fixture() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in FIXTURES.glob("*.md"))
    seen = set(re.findall(r"^! \S+ (?:error|warning)\[([a-z-]+)\]: .", text, re.MULTILINE))
    rules = raised()
    assert len(rules) > 30
    assert rules <= set(RULES)
    assert rules - seen == set()


def test_messages_are_in_the_form_of_all_messages() -> None:
    for path in FIXTURES.glob("*.md"):
        for line in path.read_text(encoding="utf-8").splitlines():
            found = re.match(r"! \S+ (?:error|warning)\[[a-z-]+\]: (.+)", line)
            if found:
                message = found[1]
                assert not message.endswith("."), message
                assert message[0] in "`'\"" or message[0].islower(), message
