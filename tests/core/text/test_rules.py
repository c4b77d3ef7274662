"""What an author sees of each rule: `tests/fixtures/rules/<rule>.md`, compared to the letter.

A case holds a smallest course that breaks the rule (see `support.rule_cases`) and all diagnostics
that the tool then prints. `[update]`, `[build]` or `[check --no-cache]` in a title says which
command finds the mistake, where it is not `check`. `[after 1 s]` gives labs less time, for mistakes
that no course can make happen soon enough. `[then RULE]` names what comes to light once a mistake
is mended. What `--fix` writes stands below.
`pytest tests/core/text --rewrite-fixtures` writes the expected parts and
`docs/reference/rules.md` anew.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.core.registry import installed_features
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.text.characters import printable
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.rules import GROUPS, RULES, Rule
from coursebuild.core.text.source import Source
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.pipeline.check import check
from coursebuild.pipeline.fix import choose_fixes
from coursebuild.pipeline.outputs import update
from coursebuild.pipeline.publication import build, export
from coursebuild.report import Style, diagnostic_text
from coursebuild.report.values import with_hints
from support.fixture_cases import Case, read_cases, rewrite
from support.rule_cases import Layout, Workshop
from support.rule_cases import workshop as workshop

_OTHER_GROUP = "Sources, names, numbers and time"
"""The section of the rules that features bring."""


def catalogue_page() -> str:
    """`docs/reference/rules.md`."""
    counts = Counter(rule.severity for rule in RULES.values())
    names = {name for group in GROUPS.values() for name in group}
    groups = {**GROUPS, _OTHER_GROUP: [name for name in RULES if name not in names]}
    head = f"""\
# Rules

Errors ({counts["error"]} rules) keep the site from being published,
`download-failed` only its button; warnings
({counts["warning"]}) can be [silenced](course-map.md#silence);
[hints](../explanation/mistakes.md#hints) ({counts["hint"]}) change nothing. `coursebuild explain
RULE` prints an entry. Where `--fix` stands over a message, [that option](commands.md#fix) mends it;
where `--propose` does, a human decides.
"""
    return head + "".join(
        f"\n## {title}\n" + "".join(_entry(RULES[name]) for name in group)
        for title, group in groups.items()
    )


def _entry(rule: Rule) -> str:
    """A section with the first message of the rule's first case, if it has a case."""
    case, *_ = CASES.get(rule.name) or [Case("", "", f"{rule.severity}[{rule.name}]: …", 0)]
    blocks = case.expected.rstrip("\n").split("\n\n")
    message = next(block for block in blocks if block.startswith(f"{rule.severity}[{rule.name}]"))
    first, *lines = message.splitlines()
    helps = [line.replace("=", "", 1).strip() for line in lines if line.startswith("    = help: ")]
    message = "\n".join([f"    {first}", *(f"        {help}" for help in helps)])

    sentences = []
    if len(_words(rule.summary) - _words(message)) > 1:  # or else the message says as much
        sentences.append(rule.summary)
    outputs = "".join(case.expected for case in CASES.get(rule.name, ()))
    options = [o for o in ("--fix", "--propose") if f"\n{o} writes" in outputs]
    if command_of(case) != "check":
        sentences.append(f"Reported by `coursebuild {command_of(case)}`.")
    if options:
        sentences.append(", ".join(f"`{option}`" for option in options))
    text = f"{' '.join(sentences)}\n\n" if sentences else ""
    return f"\n### {rule.name}\n\n{text}{message}\n"


def _words(text: str) -> set[str]:
    """The words that carry the meaning of a text, without endings."""
    words = set(re.findall("[a-z0-9]+", text.lower())) - _SMALL_WORDS
    return {re.sub("(ing|ed|es|s|e)$", "", word) for word in words}


_SMALL_WORDS = set(
    """a an the is are of in or and not no as on by to it that this has have was be been its there
    at what than with for from one can cannot may""".split()
)


installed_features()  # they add their own rules

ROOT = Path(__file__).parents[3]
FIXTURES = ROOT / "tests/fixtures/rules"
PAGE = ROOT / "docs/reference/rules.md"
FILES = {path.stem: path for path in sorted(FIXTURES.glob("*.md"))}
CASES = {name: read_cases(path) for name, path in FILES.items()}
SENTENCE = re.compile(r"(?!MuJoCo|JavaScript|Markdown|Python)[A-Z][a-z]")
MESSAGE = re.compile(r"^(error|warning|hint)\[([a-z-]+)\]: ", re.MULTILINE)
COMPILED = re.compile("models/|mjcf|mujoco")
"""What a course with something for MuJoCo has in it."""


class HurriedEngine:
    """The browser's engine, with less time for a trial where a title asks for it."""

    def __init__(self, engine: LabEngine, title: str) -> None:
        self._engine = engine
        self._time = re.search(r"\[after ([\d.]+) s\]", title)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)

    def trial(self, request: dict[str, Any], mjb: bytes, seconds: float) -> dict[str, Any]:
        return self._engine.trial(request, mjb, float(self._time[1]) if self._time else seconds)


def command_of(case: Case) -> str:
    match = re.search(r"\[((?:check|update|build|export)[\w -]*)\]", case.title)
    return match[1] if match else "check"


def print_diagnostics(case: Case, root: Path, workshop: Workshop) -> str:
    """All that the tool prints of a case, without colours, and what its fixes write.

    With them the mistakes are gone, and there is none of another rule.
    """
    diagnostics = run_case(case, root, workshop)
    fixes = choose_fixes(diagnostics, proposals=True)
    if fixes:
        fixed_texts = {s.path: apply_edits(s.text, edits) for s, edits in by_source(fixes).items()}
        after = run_case(case, root.with_name(f"{root.name}-fixed"), workshop, fixed_texts)
        rules = {d.rule for d in diagnostics}
        rules |= set(re.findall(r"\[then ([\w-]+)\]", case.title))
        new = [diagnostic_text(d, Style()) for d in after if d.is_error and d.rule not in rules]
        assert new == [], f"{case.title}:\n" + "\n\n".join(new)
        left = Counter((d.rule, d.message) for d in after)
        left.subtract((d.rule, d.message) for d in diagnostics)
        assert all(left[fix.rule, fix.message] < 0 for fix in fixes), "a fix mends nothing"
    text = "\n\n".join(diagnostic_text(d, Style()) for d in diagnostics)
    assert str(root) not in text, "a message names a folder of this machine"
    # Which part of a line a traceback underlines is different in each version of Python.
    text = re.sub(r"^ +[~^][ ~^]*\n", "", text, flags=re.MULTILINE)
    return without_page_lines(text) + "\n" + "".join(print_fixes(fixes))


def print_fixes(fixes: Sequence[Diagnostic]) -> Iterator[str]:
    """The lines that `--fix` changes, and those that `--propose` would change."""
    for option, is_safe in (("--fix", True), ("--propose", False)):
        for source, edits in by_source(f for f in fixes if f.safe is is_safe).items():
            lines, new_lines = (
                source.text.splitlines(),
                apply_edits(source.text, edits).splitlines(),
            )
            diff = list(difflib.unified_diff(lines, new_lines, n=0, lineterm=""))[2:]
            changed = "".join(f"{printable(line)}\n" for line in diff if not line.startswith("@@"))
            yield f"\n{option} writes {source.path}\n{changed}"


def by_source(fixes: Iterable[Diagnostic]) -> dict[Source, list[Edit]]:
    edits: dict[Source, list[Edit]] = {}
    for edit in (edit for fix in fixes for edit in fix.edits):
        edits.setdefault(edit.span.source, []).append(edit)
    return edits


def run_case(
    case: Case, root: Path, workshop: Workshop, fixed_texts: Mapping[str, str] = {}
) -> tuple[Diagnostic, ...]:
    """The diagnostics of a case; with texts that fixes have made, of what comes of it."""
    layout = Layout.of(case.input)
    layout.write(root)
    for path, text in fixed_texts.items():
        (root / path).write_bytes(text.encode())
    options = workshop.options(root)
    if layout.later:
        check(options)
        layout.write_later(root)
    if "```lab" in case.input and command_of(case) == "check":
        return workshop.try_labs(root, lambda engine: HurriedEngine(engine, case.title))
    match command_of(case):
        case "check":
            return check(options).diagnostics
        case "check --hints":
            return with_hints(check(options))
        case "check --strict":
            return check(replace(options, strict=True)).diagnostics
        case "check --sensitivity":
            return check(options, sensitivity=True).diagnostics
        case "check --truth":
            return check(options, truth=True).diagnostics
        case "check --no-cache":
            return check(workshop.options(root, fresh=True)).diagnostics
        case "update":
            return update(options).diagnostics
        case "build":
            return build(options, Path("public")).diagnostics
        case "export qti":
            return export(options, "qti", "", None).diagnostics
        case name:
            raise ValueError(f"no command {name!r}")


def without_page_lines(text: str) -> str:
    """Replace line numbers of built pages: they depend on templates, which are not tested here."""
    text = re.sub(r"(?<= public/)(\S+\.html):\d+:\d+", r"\1:LINE:COLUMN", text)
    if ":LINE:COLUMN" in text:
        text = re.sub(r"^ *\d+ \| ", "LINE | ", text, flags=re.MULTILINE)
        text = re.sub(r"^ +(?=\|)", "     ", text, flags=re.MULTILINE)
    return text


def tier(case: Case) -> str:
    """The pytest mark of a case that needs a lab's engine, MuJoCo or a whole site, or none."""
    if "```lab" in case.input or "```exercise" in case.input:
        return "engine"
    is_built = command_of(case).startswith(("build", "export"))
    return "site" if is_built or COMPILED.search(case.input) else ""


def marked_rules() -> Iterator[Any]:
    """A test for the cases of a rule that have the same mark."""
    for name, cases in CASES.items():
        for mark in sorted({*map(tier, cases)}):
            marks = [getattr(pytest.mark, mark)] if mark else []
            yield pytest.param(name, mark, marks=marks, id=f"{name} {mark}".strip())


@pytest.mark.parametrize(("name", "mark"), [*marked_rules()])
def test_what_the_author_sees(
    name: str, mark: str, workshop: Workshop, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    for number, case in enumerate(CASES[name]):
        if tier(case) != mark:
            continue
        output = print_diagnostics(case, tmp_path / str(number), workshop)
        if request.config.getoption("--rewrite-fixtures"):
            CASES[name][number] = replace(case, expected=output)
            rewrite(FILES[name], CASES[name])
        else:
            assert output == case.expected, f"{FILES[name].name}:{case.line}: {case.title}"


def test_every_rule_has_its_fixture_and_every_fixture_its_rule() -> None:
    """CONTRIBUTING.md says how a fixture is written."""
    missing = [f"tests/fixtures/rules/{name}.md" for name in RULES if name not in FILES]
    assert missing == [], "these are to be written"
    assert sorted(FILES.keys() - RULES.keys()) == [], "there are no such rules"


def test_each_case_of_a_fixture_shows_its_rule() -> None:
    names = {name for name, cases in CASES.items() if any(case.expected.strip() for case in cases)}
    assert sorted(CASES.keys() - names) == [], "they show nothing"
    # A case without a message is one that looks like the mistake and is none.
    failures = [
        f"{name}:{case.line}: {case.title}"
        for name, cases in CASES.items()
        for case in cases
        if case.expected.strip()
        and (RULES[name].severity, name) not in MESSAGE.findall(case.expected)
    ]
    assert failures == []


def test_messages_keep_the_style_of_the_house() -> None:
    """Lower case, no full stop; help too."""
    failures = []
    for name, cases in CASES.items():
        for line in "".join(case.expected for case in cases).splitlines():
            text = re.match(r"(?:(?:error|warning|hint)\[[a-z-]+\]| *= help): (.*)", line)
            if text and (SENTENCE.match(text[1]) or re.search(r"(?<!\.)\.$", text[1])):
                failures.append(f"{name}: {line}")
    assert failures == []


def test_the_page_of_rules_is_in_step(request: pytest.FixtureRequest) -> None:
    page = catalogue_page()
    if request.config.getoption("--rewrite-fixtures"):
        PAGE.write_text(page, encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == page, "run pytest tests/core/text --rewrite-fixtures"
