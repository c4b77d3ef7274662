"""Settings of course.toml for the build: comparison of outputs, callouts, silenced warnings.

Entry points: `check_settings`; `comparison` and `callout_kinds`, the values of these settings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from decimal import Decimal

from coursebuild.core.model import CalloutKind, Comparison, Filter, Mode, Silence
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.syntax.course_schema import CalloutTable, CourseFile, VerifyTable
from coursebuild.core.syntax.decode import Decoding
from coursebuild.core.syntax.nodes import NumberNode, ObjectNode, StringNode
from coursebuild.core.syntax.wording import format_name
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.patterns import pattern_mistake
from coursebuild.core.text.rules import RULES
from coursebuild.core.text.source import Span

_VARIABLE = re.compile(r"(?!PYTHON|PATH$|TMPDIR$)[A-Za-z_][A-Za-z0-9_]*")
_CALLOUT = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def check_settings(root: ObjectNode, decoding: Decoding[CourseFile]) -> Iterator[Diagnostic]:
    """Check what the types of these tables cannot say."""
    for node, fields in decoding.find_structs(VerifyTable):
        yield from _check_verify(node, fields)
    for node, filter in decoding.find_structs(Filter):
        yield from _check_filter(node, filter)
    for name, member in root.object("verify").object("env").members.items():
        if not _VARIABLE.fullmatch(name):
            message = f"{format_name(name)} cannot be set for scripts"
            help = "expected: a name of your own, as in `FAST`"
            yield diagnose("field-value", member.key.span, message, help=help)
    for name, member in root.object("callouts").members.items():
        if not _CALLOUT.fullmatch(name):
            message = f"{format_name(name)} cannot be a kind of callout"
            help = "expected: lower-case letters and digits in words joined by single hyphens"
            yield diagnose("field-value", member.key.span, message, help=help)
    for node, silence in decoding.find_structs(Silence):
        yield from _check_silence(node, silence)


def _check_verify(node: ObjectNode, fields: VerifyTable) -> Iterator[Diagnostic]:
    tolerances = [m for name in ("rtol", "atol") if (m := node.members.get(name)) is not None]
    if fields.compare == "rtol" and not tolerances:
        message = '`compare = "rtol"` needs `rtol` or `atol`'
        yield diagnose("field-missing", node.place("compare"), message)
    if fields.compare in ("exact", "digits"):
        for member in tolerances:
            message = f'`{member.key.value}` counts only with `compare = "rtol"`'
            yield diagnose("field-value", member.key.span, message)


def comparison(node: ObjectNode, fields: VerifyTable) -> Comparison:
    """The comparison of outputs whose fence names none; tolerances alone mean `rtol`."""
    rtol, atol = _decimal(node, "rtol"), _decimal(node, "atol")
    implied = "exact" if rtol is None and atol is None else "rtol"
    mode = Mode(fields.compare or implied)
    return Comparison(mode, rtol or Decimal(0), atol or Decimal(0), fields.ellipsis)


def _decimal(node: ObjectNode, name: str) -> Decimal | None:
    """The number as it is written, not its nearest double."""
    value = node.get(name)
    if not isinstance(value, NumberNode):
        return None
    return Decimal(value.raw) if isinstance(value.value, float) else Decimal(value.value)


def _check_filter(node: ObjectNode, fields: Filter) -> Iterator[Diagnostic]:
    if (mistake := pattern_mistake(fields.pattern)) is not None:
        message = f"the pattern does not compile: {mistake[0]}"
        yield diagnose("field-value", _place(node, "pattern", mistake[1]), message)
    elif (mistake := pattern_mistake(fields.pattern, fields.replacement)) is not None:
        message = f"the replacement cannot be used: {mistake[0]}"
        yield diagnose("field-value", _place(node, "replacement", mistake[1]), message)


def _place(node: ObjectNode, name: str, at: int | None) -> Span:
    """The character at an offset of a string, or the whole string."""
    value = node.get(name)
    if not isinstance(value, StringNode) or at is None or at >= len(value.value):
        return node.place(name)
    return value.excerpt.span(at, at + 1)


def callout_kinds(tables: Mapping[str, str | CalloutTable]) -> tuple[CalloutKind, ...]:
    """The kinds that every course has, perhaps with labels of its own, and its further kinds."""
    kinds = {name: CalloutKind(name) for name in CALLOUTS}
    for name, table in tables.items():
        texts = (table,) if isinstance(table, str) else (table.label, table.promise)
        kinds[name] = CalloutKind(name, *texts)
    return tuple(kinds.values())


def _check_silence(node: ObjectNode, fields: Silence) -> Iterator[Diagnostic]:
    rule = RULES.get(fields.rule)
    if rule is None:
        warning_names = [name for name, entry in RULES.items() if entry.severity == "warning"]
        message = f"there is no rule {format_name(fields.rule)}"
        help = did_you_mean(fields.rule, warning_names)
        yield diagnose("silence-rule", node.place("rule"), message, help=help)
    elif rule.severity == "error":
        message = f"`{fields.rule}` is an error; only warnings can be silenced"
        yield diagnose("silence-rule", node.place("rule"), message)
    if not fields.reason.strip():
        message, help = "the silence gives no reason", 'say why: `reason = "…"`'
        yield diagnose("silence-rule", node.place("reason"), message, help=help)
