"""What an author sees of each rule: `tests/fixtures/rules/<rule>.md`, compared to the letter.

A case names a smallest course that breaks the rule (see `scratch`) and all diagnostics that the
tool then prints. `[update]`, `[build]` or `[check --no-cache]` in a title says which command finds
the mistake, where it is not `check`. `{package.module.name = value}` in a title gives a constant
another value, and `{package.module.name() = value}` a function another result, for what no course
can bring about, or not in time. `pytest tests/rules --rewrite-fixtures` writes the expected parts
and `docs/rules.md` anew.
"""

from __future__ import annotations

import ast
import re
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import pytest
from msgspec.structs import replace

from coursebuild.effects.store import Store
from coursebuild.pipeline.build import build
from coursebuild.pipeline.check import check
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.packages import export
from coursebuild.pipeline.update import update
from coursebuild.report import Style, diagnostic_text
from coursebuild.report.catalogue import Example, ExampleFile, catalogue_page
from coursebuild.rules import RULES
from support.rule_cases import Case, Layout, parts, put, read_cases

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "tests/fixtures/rules"
PAGE = ROOT / "docs/rules.md"
FILES = {path.stem: path for path in sorted(FIXTURES.glob("*.md"))}
CASES = {name: read_cases(path) for name, path in FILES.items()}
SENTENCE = re.compile(r"(?!MuJoCo|JavaScript|Markdown|Python)[A-Z][a-z]")
TOLD = re.compile(r"^(error|warning)\[([a-z-]+)\]: ", re.MULTILINE)


def command(case: Case) -> str:
    """The command that a case is for."""
    found = re.search(r"\[([\w -]+)\]", case.title)
    return found[1] if found else "check"


def changed(case: Case) -> ExitStack:
    """The constants that the title changes, until the end of the block."""
    stack = ExitStack()
    for name, function, value in re.findall(r"\{([\w.]+)(\(\))? = (.*?)\}", case.title):
        literal = ast.literal_eval(value)
        stack.enter_context(patch(name, (lambda v=literal: v) if function else literal))
    return stack


def told(case: Case, root: Path) -> str:
    """All that the tool says of a case, without colours."""
    with changed(case):
        return told_by(case, root)


def told_by(case: Case, root: Path) -> str:
    layout = Layout.of(case.input)
    layout.write(root)
    options = Options(root, jobs=2, quiet=True)
    if layout.later:
        check(options)
        for path, data in layout.later.items():
            put(root / path, data)
    match command(case):
        case "check":
            report = check(options)
        case "check --no-cache":
            report = check(replace(options, cache=Store(root, fresh=True)))
        case "update":
            report = update(options)
        case "build":
            report = build(options, Path("public"))
        case "export qti":
            report = export(options, "qti", Path("quizzes.zip"))
        case other:
            raise ValueError(f"no command {other!r}")
    text = "\n\n".join(diagnostic_text(d, Style()) for d in report.diagnostics)
    assert str(root) not in text, "a message names a folder of this machine"
    # Which part of a line a traceback underlines is different in each version of Python.
    text = re.sub(r"^ +[~^][ ~^]*\n", "", text, flags=re.MULTILINE)
    return _without_page_lines(text) + "\n"


def _without_page_lines(text: str) -> str:
    """Lines of a built page depend on its template, which is not what these fixtures are about."""
    text = re.sub(r"(?<= public/)(\S+\.html):\d+:\d+", r"\1:LINE:COLUMN", text)
    if ":LINE:COLUMN" in text:
        text = re.sub(r"^ *\d+ \| ", "LINE | ", text, flags=re.MULTILINE)
        text = re.sub(r"^ +(?=\|)", "     ", text, flags=re.MULTILINE)
    return text


@pytest.mark.parametrize("name", FILES)
def test_what_the_author_sees(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    found = []
    for number, case in enumerate(CASES[name]):
        root = tmp_path / str(number)
        root.mkdir()
        found.append(replace(case, expected=told(case, root)))
    if request.config.getoption("--rewrite-fixtures"):
        FILES[name].write_text("".join(case.text for case in found), encoding="utf-8")
        CASES[name] = found
    for case, now in zip(CASES[name], found, strict=True):
        assert now.expected == case.expected, f"{FILES[name].name}:{case.line}: {case.title}"


def test_every_rule_has_its_fixture_and_every_fixture_its_rule() -> None:
    assert set(FILES) == set(RULES)


@pytest.mark.parametrize("name", FILES)
def test_the_fixture_shows_its_rule(name: str) -> None:
    assert CASES[name], "an empty fixture shows nothing"
    for case in CASES[name]:
        found = {(severity, rule) for severity, rule in TOLD.findall(case.expected)}
        assert (RULES[name].severity, name) in found, f"line {case.line}: {case.title}"


def test_messages_keep_the_style_of_the_house() -> None:
    """Lower case, no full stop; help too."""
    wrong = []
    for name, cases in CASES.items():
        for line in "".join(case.expected for case in cases).splitlines():
            said = re.match(r"(?:(?:error|warning)\[[a-z-]+\]| *= help): (.*)", line)
            if said and (SENTENCE.match(said[1]) or re.search(r"(?<!\.)\.$", said[1])):
                wrong.append(f"{name}: {line}")
    assert wrong == []


def test_the_page_of_rules_is_in_step(request: pytest.FixtureRequest) -> None:
    examples = {name: example(cases[0]) for name, cases in CASES.items()}
    page = catalogue_page(examples)
    if request.config.getoption("--rewrite-fixtures"):
        PAGE.write_text(page, encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == page, "run pytest tests/rules --rewrite-fixtures"


def example(case: Case) -> Example:
    """A case as the page of rules shows it."""
    return Example(
        command(case),
        tuple(shown(kind, path, body) for kind, path, body in parts(case.input)),
        case.expected.rstrip("\n"),
    )


def shown(kind: str, path: str, body: str) -> ExampleFile:
    """A file of an input as the page of rules shows it."""
    match kind:
        case "later":
            return ExampleFile(path, ", once the scripts are extracted", body)
        case "bytes":
            return ExampleFile(path, ", where `\\x…` is a byte", body)
        case "link":
            path, _, target = path.partition(" -> ")
            return ExampleFile(path, f" is a link to `{target}`", "")
        case "folder":
            return ExampleFile(path, " is a folder", "")
        case "without":
            return ExampleFile(path, " is not there", "")
        case _:
            return ExampleFile(path, "", body)
