"""`coursebuild.api`, from outside: its reference, and a distribution that imports nothing else."""

from __future__ import annotations

import ast
import importlib
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from coursebuild import api
from support.fixture_cases import fixture_tables, fixture_text
from support.scratch_course import ROOT, CommandResult, Folder

PAGE = ROOT / "docs/reference/api.md"
HEAD = fixture_text("documents/api_head.md")
SUBJECTS = fixture_tables("api")["subjects"]
"""The sections of the reference, with the modules whose names stand there."""


@cache
def sources() -> dict[str, str]:
    """Where each name of the interface comes from."""
    text = Path(api.__file__).read_text(encoding="utf-8")
    return {
        alias.name: statement.module
        for statement in ast.walk(ast.parse(text))
        if isinstance(statement, ast.ImportFrom)
        and (statement.module or "").startswith("coursebuild")
        for alias in statement.names
        if statement.module
    }


@cache
def statements(module: str) -> list[ast.stmt]:
    path = importlib.import_module(module).__file__
    assert path is not None
    return ast.parse(Path(path).read_text(encoding="utf-8")).body


def documented(body: list[ast.stmt]) -> Iterator[tuple[str, str, ast.stmt]]:
    """Each name that statements define, with what they say of it."""
    for statement, following in zip(body, [*body[1:], None], strict=True):
        text = ""
        match statement, following:
            case ast.ClassDef() | ast.FunctionDef(), _:
                text = ast.get_docstring(statement) or ""
                yield statement.name, text, statement
                continue
            case ((ast.Assign() | ast.AnnAssign()), ast.Expr(ast.Constant(str(text)))):
                pass
            case _:
                pass
        targets = statement.targets if isinstance(statement, ast.Assign) else ()
        targets = [statement.target] if isinstance(statement, ast.AnnAssign) else targets
        for target in targets:
            for name in target.elts if isinstance(target, ast.Tuple) else (target,):
                if isinstance(name, ast.Name):
                    yield name.id, text, statement


def find(module: str, name: str) -> tuple[str, ast.stmt]:
    """What the module that defines a name says of it."""
    for definition, text, statement in documented(statements(module)):
        if definition == name:
            return text, statement
    for statement in statements(module):
        source = statement.module if isinstance(statement, ast.ImportFrom) else None
        if isinstance(statement, ast.ImportFrom) and (source or "").startswith("coursebuild."):
            for alias in statement.names:
                if alias.name == name or alias.name == "*":
                    with suppress(LookupError):
                        return find(source or "", name)
    raise LookupError(f"{module} defines no {name}")


def first_sentence(text: str) -> str:
    return " ".join(text.strip().partition("\n\n")[0].split())


def form(statement: ast.stmt) -> str:
    """A field with its type and default, a function with its arguments."""
    match statement:
        case ast.AnnAssign(annotation=ast.Subscript(ast.Name("Annotated"), ast.Tuple([kind, *_]))):
            return f"{ast.unparse(statement.target)}: {ast.unparse(kind)}"
        case ast.AnnAssign():
            return ast.unparse(statement)
        case ast.FunctionDef(name, arguments, returns=result):
            if any(ast.unparse(d).endswith("property") for d in statement.decorator_list):
                return f"{name}: {ast.unparse(result) if result else ''}"
            parameters = [*arguments.posonlyargs, *arguments.args]
            if parameters and parameters[0].arg in ("self", "cls"):
                (arguments.posonlyargs or arguments.args).pop(0)
            return f"{name}({ast.unparse(arguments)})" + (
                f" -> {ast.unparse(result)}" if result else ""
            )
        case ast.Assign():
            return ast.unparse(statement.targets[0])
        case _:
            return statement.name if isinstance(statement, ast.ClassDef) else ""


def members(module: str, statement: ast.ClassDef) -> Iterator[tuple[str, str, ast.stmt]]:
    """Fields and methods, of the classes of the tool that it is made from too."""
    for base in statement.bases:
        with suppress(LookupError):
            _, parent = find(module, ast.unparse(base))
            if isinstance(parent, ast.ClassDef):
                yield from members(module, parent)
    yield from documented(statement.body)


def entry(name: str) -> str:
    """The lines of the reference about a name: what it is, and each of its fields and methods."""
    value = getattr(api, name)
    if isinstance(value, ModuleType):
        path = f"`{value.__name__.replace('.', '/')}`"
        return f"- `{name}` ({path}): {first_sentence(value.__doc__ or '')}\n"
    source = sources()[name]
    text, statement = find(source, name)
    assert first_sentence(text), f"nothing says what {name} is"
    own_form = form(statement) if isinstance(statement, ast.FunctionDef) else name
    lines = [f"- `{own_form}`: {first_sentence(text)}\n"]
    if isinstance(statement, ast.ClassDef):
        lines += [
            f"  - `{form(inner)}`"
            + (f": {sentence}\n" if (sentence := first_sentence(text)) else "\n")
            for member, text, inner in members(source, statement)
            if not member.startswith("_")
        ]
    return "".join(lines)


def reference() -> str:
    parts = [HEAD.format(version=api.API)]
    for subject, modules in SUBJECTS.items():
        names = [name for name, module in sources().items() if module[12:] in modules]
        parts.append(f"\n## {subject}\n\n" + "".join(map(entry, names)))
    return "".join(parts)


def test_the_reference_of_the_interface_is_in_step(request: pytest.FixtureRequest) -> None:
    page = reference()
    if request.config.getoption("--rewrite-fixtures"):
        PAGE.write_text(page, encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == page, "run pytest FILE --rewrite-fixtures"


def test_every_public_name_has_its_subject_and_is_there() -> None:
    modules = [module for group in SUBJECTS.values() for module in group]
    assert sorted(modules) == sorted({module[12:] for module in sources().values()})
    assert [name for name in sources() if not hasattr(api, name)] == []
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = api.nothing


LESSON = "## Fall\n\n```assignment points=4\nHow *fast* does it fall?\n```\n"


@pytest.fixture(scope="module")
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A distribution that imports nothing else of the tool, installed."""
    source, folder = (tmp_path_factory.mktemp(name) / "plugin" for name in ("source", "installed"))
    shutil.copytree(ROOT / "tests/fixtures/plugin", source)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder)]
    subprocess.run([*pip, *offline, str(source)], check=True)
    return folder


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "a course")
    folder.fill([LESSON], stores)
    return folder


def run(folder: Folder, plugin: Path, *words: str) -> CommandResult:
    return folder.run(*words, env={"PYTHONPATH": f"{plugin}:{ROOT}"})


@pytest.mark.site
def test_a_distribution_brings_a_fence_a_page_texts_and_a_command(
    course: Folder, plugin: Path
) -> None:
    course.replace("content/course.toml", "[course]\n", '[course]\nlanguage = "de"\n')
    result = run(course, plugin, "build")
    assert result.status == 0, result.out
    html = course.text("public/lessons/1.1-one.html")
    assert '<div class="assignment"><p>4 Punkte</p>\n<p>How <em>fast</em> does it fall?</p>' in html
    assert "**4 Punkte**" in course.text("public/lessons/1.1-one.md")
    page = course.text("public/assignments/index.html")
    assert re.search(r'<li><a href="\.\./lessons/1\.1-one\.html">[^<]+</a>: 4</li>', page)
    assert "Assignments" in html, "the foot of every page leads to the page, in English if need be"
    assert run(course, plugin, "points") == CommandResult(0, "4 points\n", "")
    assert run(course, plugin, "points", "--least", "5").out == "0 points\n"
    refusal = CommandResult(2, "", "coursebuild: `--least` is a number of points\n")
    assert run(course, plugin, "points", "--least", "-1") == refusal
    assert "print the points of a course" in run(course, plugin, "--help").out


@pytest.mark.site
def test_a_distribution_brings_rules(course: Folder, plugin: Path) -> None:
    course.write(course.lesson(), LESSON.replace("=4", "=8") * 2 + "\n```assignment\nWhy?\n```\n")
    result = run(course, plugin, "check")
    assert result.status == 1
    assert "error[assignment-points]: it has no points" in result.out
    assert "warning[assignment-sum]: this lesson has more than ten points" in result.out
    assert (
        "A lesson gives more than ten points."
        in run(course, plugin, "explain", "assignment-sum").out
    )


@pytest.mark.site
def test_a_feature_for_a_newer_interface_is_refused(
    course: Folder, plugin: Path, tmp_path: Path
) -> None:
    newer = tmp_path / "newer"
    shutil.copytree(plugin, newer)
    code = newer / "assignment_plugin/__init__.py"
    text = code.read_text(encoding="utf-8")
    for old, new, reason in (
        ("api=1", "api=99", f"it needs version 99 of `coursebuild.api`, and this is {api.API}: "),
        ("    urls,\n", "    urls,\n    wormholes,\n", "cannot import name 'wormholes' from"),
    ):
        code.write_text(text.replace(old, new), encoding="utf-8")
        result = run(course, newer, "check")
        assert result.status == 1
        assert f"the entry point assignment_plugin:FEATURE cannot be used: {reason}" in result.err
        assert "install a newer coursebuild" in result.err
        assert "Traceback" not in result.err
