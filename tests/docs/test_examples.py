"""Every command and example of README, CONTRIBUTING, the manual and `--help` is tried.

A fence that `ELSEWHERE` knows is tried by the test that it names. All others are tried here: what a
shell runs, in a course that has what they name; tables of the map and of models against their
schema; Python by running it; Markdown by reading it. `UNTRIED` says of what cannot be run here why
not; of these commands the arguments are read all the same.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from coursebuild.cli.commands import known_commands, parser_of
from coursebuild.core.syntax.course_schema import json_schema
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.fixture_cases import fixture_text
from support.markdown_files import PAGES, ROOT, Fence, code_spans, fences
from support.scratch_course import Folder
from support.workflows import commit, git

ELSEWHERE = {
    r"tutorial ": "docs/test_tutorial.py",
    r"README \w+ (file=|drift=)": "docs/test_documents.py",
    r"(continuous-integration|publish) yaml ": "features/authoring/test_workflows.py",
    r"[\w-]+ \w+ (file=|map|lesson|prints)": "docs/test_authoring.py",
    r"features python": "features/test_course_features.py",
    r"features markdown": "features/test_packages.py",
    r"theme (toml|css)": "pipeline/test_theme.py",
}
"""Tests of fences, by page, kind and the words after it."""
UNTRIED = {
    r"pipx? install|make vscode|.* --against": "needs packages that must be downloaded",
    r"rsync|npx|coursebuild \w+ --cache s3:": "needs a server, and whoever may write to it",
    r"code ": "needs Visual Studio Code",
    r"make (site|test|quick|pages|release-files)": "makes all that the tests are part of",
    r"pytest --coursebuild": "tried in cli/test_pytest_plugin.py",
    r"pytest tests": "tried in features/authoring/test_new.py",
    r"coursebuild (-C \S+ )?(serve|lsp)": "runs until it ends; tried in pipeline/test_serving.py",
    r"coursebuild (-C \S+ )?(bench|stability|diet)": (
        "measures for minutes; tried in features/bench/"
    ),
    r"coursebuild \w+ .*--sandbox": "needs a system with a sandbox; tried in core/run/",
    r"coursebuild export pdf": "needs a browser; tried in features/book/",
    r"coursebuild diff .*--base-site": "needs two built sites; tried in features/test_diff.py",
}
"""Why commands are not run, by how they begin."""
FENCES = [
    fence
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES)
    for fence in fences(path)
    if not any(
        re.match(label, describe)
        for label in ELSEWHERE
        for describe in [" ".join((fence.page, fence.kind, *fence.words))]
    )
]

MAP = fixture_text("documents/swings.toml")
SCRIPT = "## A script\n\n```python file=examples/{}.py\nprint(2)\n```\n\n```output\n2\n```\n"
LAB = fixture_text("documents/docs_lab.md")
LESSON = '{"id": "1.4", "slug": "large-swings"}'
BEFORE = {
    "explain models/pendulum.xml": ["new model pendulum"],
    "undo": ["new model pendulum"],
    "rename": ['new level 2 "Two"', 'new lesson 1.4 "Large swings"'],
}
"""What makes what commands name, by how they begin."""


def command_lines(fence: Fence) -> list[str]:
    """The commands of a fence of a terminal, without their comments."""
    lines = fence.text.splitlines()
    if fence.kind != "sh":
        lines = [
            line.removeprefix("$ ") for line in lines if re.match(r"(\$ |eval |coursebuild )", line)
        ]
    return [re.split(r"  +| +#| [>|] ", line)[0].strip() for line in lines]


HELP = [
    line.strip()
    for command in known_commands().values()
    for line in (parser_of(command).epilog or "").splitlines()[1:]
]
"""The examples that end the help of commands."""
COMMANDS = [
    line
    for fence in [*FENCES, Fence("help", 1, "console", (), "\n".join(HELP))]
    if fence.kind in ("sh", "console", "text")
    for line in dict.fromkeys(command_lines(fence))
]


@pytest.fixture(scope="module")
def swings(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course in a repository, built, with all that the commands name."""
    folder = Folder(tmp_path_factory.mktemp("examples") / "course")
    folder.write("content/course.toml", MAP)
    folder.write("content/lessons/1.1-pendulum.md", SCRIPT.format("l1_1") + LAB)
    folder.write("content/lessons/1.2-lab.md", SCRIPT.format("l1_2"))
    folder.write("content/lessons/4.2-mass.md", SCRIPT.format("l4_2"))
    folder.write(".gitignore", "public\n.coursebuild\nexamples\n")
    folder.borrow(stores)
    folder.main("build").require_success()
    folder.main("check", "--write-timings", "timings.json")
    git(folder.root, "init", "-q", "-b", "main")
    commit(folder.root)
    return folder


@pytest.mark.site
@pytest.mark.engine
def test_every_command_runs(swings: Folder, tmp_path: Path) -> None:
    failures = {}
    for number, line in enumerate(dict.fromkeys(COMMANDS)):
        inner = re.search(r"\$\((coursebuild [^)]+)\)", line)
        words = shlex.split(inner[1] if inner else line)
        if any(re.match(pattern, line) for pattern in UNTRIED) or words[0] != "coursebuild":
            continue
        folder = swings.duplicate(tmp_path / str(number) / "course")
        prepare(folder, words[1:])
        result = folder.main(*words[1:])
        if result.status:
            failures[line] = result.out + result.err
    assert failures == {}


def prepare(folder: Folder, words: list[str]) -> None:
    line = " ".join(words)
    for start, commands in BEFORE.items():
        for command in commands if line.startswith(start) else ():
            folder.main(*shlex.split(command))
    if words[0] == "-C":
        folder.main("init", words[1])
    elif words[0] == "init":
        shutil.rmtree(folder.root)
        folder.root.mkdir()
    elif words[0] == "undo":
        folder.write("content/lessons/1.2-lab.md", "## A word {#word\n\nText.\n")
        assert "fixed 1 mistake" in folder.main("check", "--fix").out
    elif words[0] == "import":
        cell = {"cell_type": "markdown", "metadata": {}, "source": "# Old\n\nText.\n"}
        notebook = {"cells": [cell], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}
        place = folder.root / words[1]
        place = place if place.suffix else place / "first.ipynb"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(notebook))
    elif "../before" in words:
        shutil.copytree(folder.root, folder.root.parent / "before", symlinks=True)


def test_every_command_and_option_is_known() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for line in COMMANDS:
        inner = re.search(r"\$\((coursebuild [^)]+)\)", line)
        program, *words = shlex.split(inner[1] if inner else line)
        if program == "coursebuild":
            name, *arguments = words[2:] if words[0] == "-C" else words
            parser_of(known_commands()[name]).parse_args(arguments)
        elif program == "make":
            assert re.search(rf"^{words[0]}:", makefile, re.MULTILINE), line


def test_commands_in_sentences_are_known(capsys: pytest.CaptureFixture[str]) -> None:
    """The sentence may say what is left out."""
    refusals = {}
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES):
        for line in code_spans(path):
            called = re.match(
                r"(?:\.venv/bin/)?coursebuild (?:-C \S+ )?([a-z]+)((?: [^=…]+)?)$", line
            )
            if called is None or called[1] == "help":
                continue
            try:
                parser_of(known_commands()[called[1]]).parse_args(shlex.split(called[2]))
            except SystemExit:
                message = capsys.readouterr().err
                if not re.search("are required:|expected one argument", message):
                    refusals[f"{path.name}: {line}"] = message
    assert refusals == {}


def test_whatever_is_not_run_has_its_reason() -> None:
    programs = {"coursebuild", "eval", "git", "export"}
    unknown = [
        line
        for line in COMMANDS
        if line.split()[0] not in programs and not any(re.match(p, line) for p in UNTRIED)
    ]
    assert unknown == []
    tests = [*ELSEWHERE.values(), *re.findall(r"tried in ([\w/.]+)", str(UNTRIED))]
    assert [path for path in tests if not (ROOT / "tests" / path).exists()] == []


@pytest.mark.site
def test_the_site_is_put_on_a_branch_by_its_lines(swings: Folder, tmp_path: Path) -> None:
    (lines,) = (fence.text for fence in FENCES if "gh-pages" in fence.text)
    folder = swings.duplicate(tmp_path / "course")
    git(tmp_path, "init", "-q", "--bare", "origin")
    git(folder.root, "remote", "add", "origin", str(tmp_path / "origin"))
    people = {
        f"GIT_{role}_{part}": "a@b"
        for role in ("AUTHOR", "COMMITTER")
        for part in ("NAME", "EMAIL")
    }
    script = ["bash", "-e", "-c", lines]
    environment = folder.environment(people)
    subprocess.run(script, cwd=folder.root, env=environment, check=True, capture_output=True)
    files = git(tmp_path / "origin", "ls-tree", "-r", "--name-only", "gh-pages").splitlines()
    assert {"index.html", "lessons/4.2-mass.html"} <= set(files)
    assert git(folder.root, "status", "--porcelain") == ""


# ------------------------------------------------------------------------------------ examples


def without_required(schema: Any) -> Any:
    if isinstance(schema, dict):
        return {k: without_required(value) for k, value in schema.items() if k != "required"}
    return [without_required(x) for x in schema] if isinstance(schema, list) else schema


def test_tables_have_fields_that_there_are() -> None:
    """Those of the map or of a model; of other tools' files it is read that they are TOML."""
    schemas = [
        Draft202012Validator(without_required(json.loads(json_schema(name))))
        for name in ("course", "model")
    ]
    mistakes = []
    for fence in (fence for fence in FENCES if fence.kind == "toml"):
        table = tomllib.loads(fence.text)
        is_other = {"project", "language-server", "language"} & table.keys()
        if not is_other and not any(schema.is_valid(table) for schema in schemas):
            mistakes.append(str(fence))
    assert mistakes == []


def test_python_runs() -> None:
    for fence in (fence for fence in FENCES if fence.kind == "python"):
        exec(compile(fence.text, str(fence), "exec"), {})


def test_markdown_can_be_read() -> None:
    for fence in (fence for fence in FENCES if fence.kind == "markdown"):
        assert (
            parse_document(Source(str(fence), fence.text), frozenset(), lesson=True).diagnostics
            == ()
        ), str(fence)


def test_json_can_be_read() -> None:
    for fence in (fence for fence in FENCES if fence.kind == "json"):
        json.loads(fence.text)
