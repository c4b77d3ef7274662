"""`pytest --coursebuild`: each script, lab, quiz, model and page of a course is a test.

pytest finds this plug-in by itself. Without the option, or `coursebuild = true` in pytest's
configuration, it does nothing.

1. When the first test of a course runs, `coursebuild check` checks the lessons of all chosen tests.
2. A diagnostic belongs to the test in whose text it stands, else to its page or model, else to the
   map.
"""

from __future__ import annotations

import re
import warnings
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

import pytest

from coursebuild.core.files.course_root import MAP, find_course_root
from coursebuild.core.run import gate
from coursebuild.core.text.characters import without_commands
from coursebuild.core.text.regex import regex

_PAGE, _MAP, _MODEL = "page", "map", "model"
_PLACE = regex(r"^ *--> (.*):(\d+):\d+$", re.MULTILINE)
_HELP = "collect the scripts, labs, quizzes, models and pages of courses as tests"

_Lines = tuple[tuple[int, int], ...]
"""Parts of a file, by their first and last line."""


class CourseWarning(UserWarning):
    """A warning of `coursebuild check`."""


class CourseError(Exception):
    """Mistakes in a course, as `coursebuild check` prints them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option and its entry in pytest's configuration."""
    parser.getgroup("coursebuild").addoption("--coursebuild", action="store_true", help=_HELP)
    parser.addini("coursebuild", _HELP, type="bool", default=False)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> FileTests | None:
    """Collect the tests of a file that belongs to a course."""
    config = parent.config
    if not (config.getoption("coursebuild") or config.getini("coursebuild")):
        return None
    root = find_course_root(str(file_path.parent))
    if root is None or file_path.suffix not in (".md", ".toml", ".xml"):
        return None
    courses = config.stash.setdefault(_COURSES, {})
    if root not in courses:
        courses[root] = CourseTests(Path(root))
    path = file_path.resolve().relative_to(root).as_posix()
    if path not in courses[root].tests:
        return None
    file: FileTests = FileTests.from_parent(parent, path=file_path)
    file.course, file.source = courses[root], path
    return file


class CourseTests:
    """The tests of a course, and their results, which `check` finds when the first of them runs."""

    def __init__(self, root: Path) -> None:
        from coursebuild.core.model import FeatureBlock, Recording, document_blocks
        from coursebuild.core.model.blocks import Script, ScriptPart
        from coursebuild.core.registry import feature_trials
        from coursebuild.pipeline.load import load

        course = load(root).value
        self.root = root
        self.tests: dict[str, Mapping[str, _Lines]] = {MAP: {_MAP: ()}}
        """By path and name: where in the file the test's mistakes stand. The first test of a file
        has those that stand in none of the others."""
        self._results: dict[str, list[tuple[str, str]]] | None = None
        if course is None:
            return
        self.tests |= {model.source.path: {_MODEL: ()} for model in course.models}
        trials = {id(trial.block): name for name, (_, trial) in feature_trials(course).items()}
        for document in course.documents:
            tests: dict[str, _Lines] = {_PAGE: ()}
            for block in document_blocks(document):
                name: str | None = None
                if isinstance(block, Script | ScriptPart):
                    name = block.path
                elif isinstance(block, Recording):
                    name = block.script
                elif isinstance(block, FeatureBlock):  # a lab or a quiz
                    name = trials.get(id(block)) or (block.progress_keys() or (None,))[0]
                if name is not None:
                    tests[name] = (*tests.get(name, ()), (block.span.line, block.span.end_line))
            self.tests[document.source.path] = tests

    def results_of(self, session: pytest.Session, test: str) -> list[tuple[str, str]]:
        """The results of a test: JUnit's tags, with their texts."""
        if self._results is None:
            items = (item for item in session.items if isinstance(item, CourseItem))
            sources = {item.source for item in items if item.course is self}
            checks_everything = any(_PAGE not in self.tests[source] for source in sources)
            self._results = self._check(() if checks_everything else sorted(sources))
        return self._results[test]

    def _check(self, names: Iterable[str]) -> dict[str, list[tuple[str, str]]]:
        check = ("-C", str(self.root), "check", "--format", "junit")
        command = gate.module_command("coursebuild", *check, *names)
        result = gate.finish(command, gate.environment(*gate.TOOL))
        if not result.output:  # no test has a result, and all say why
            message = result.errors.decode("utf-8", "replace")
            return defaultdict(lambda: [("failure", message)])
        owners = {name: path for path, tests in self.tests.items() for name in tests}
        results: dict[str, list[tuple[str, str]]] = defaultdict(list)
        for case in ElementTree.fromstring(result.output).iter("testcase"):
            name = case.get("name", "")
            for part in case:
                text = part.text or f"{name}: {part.get('message')}"
                test = self._find_test(text) if part.text else f"{owners.get(name)}::{name}"
                results[test].append((part.tag, text))
        return results

    def _find_test(self, diagnostic: str) -> str:
        place = _PLACE.search(diagnostic)
        if place is None or place[1] not in self.tests:
            return f"{MAP}::{_MAP}"
        tests, line = self.tests[place[1]], int(place[2])
        matching = (n for n, at in tests.items() if any(a <= line <= b for a, b in at))
        return f"{place[1]}::{next(matching, next(iter(tests)))}"


_COURSES = pytest.StashKey[dict[str, CourseTests]]()


class FileTests(pytest.File):
    """A lesson, a page, a model or the map."""

    course: CourseTests
    source: str
    """Its path in the course."""

    def collect(self) -> Iterator[CourseItem]:
        """Collect the file's tests."""
        for name in self.course.tests[self.source]:
            item: CourseItem = CourseItem.from_parent(self, name=name)
            item.course, item.source = self.course, self.source
            yield item


class CourseItem(pytest.Item):
    """A test of a file."""

    course: CourseTests
    source: str

    def runtest(self) -> None:
        """Fail, warn or skip, as the results say."""
        parts = self.course.results_of(self.session, f"{self.source}::{self.name}")
        texts = {tag: [text for kind, text in parts if kind == tag] for tag, _ in parts}
        for text in texts.get("system-out", ()):
            warnings.warn(CourseWarning(text), stacklevel=1)
        if "failure" in texts:
            raise CourseError("\n\n".join(texts["failure"]))
        if "skipped" in texts:
            pytest.skip(texts["skipped"][0])

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return the mistakes as `coursebuild check` prints them."""
        if isinstance(excinfo.value, CourseError):
            return without_commands(str(excinfo.value))
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return where the test is, and the heading of its report."""
        return self.path, 0, f"{self.source}: {self.name}"
