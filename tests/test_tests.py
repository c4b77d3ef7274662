"""Rules for tests: they wait for what happens, not for time, and patch no private name.

A page moves on by itself after whatever is done to it. So what a test looks at after that is an
expectation that is tried until it holds (`expect(...)`, `until`, `becomes`), never an assertion
that looks once.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from textwrap import indent

import pytest

from support.fixture_cases import Case, check_cases

HERE = Path(__file__).parent
ACTIONS = frozenset(
    "blur check clear click dblclick dispatch_event drag_to emulate_media fill focus go_back "
    "go_forward goto hover press reload select_option set_checked set_input_files "
    "set_viewport_size tap type uncheck".split()
)
READINGS = frozenset(
    "all all_inner_texts all_text_contents bounding_box count evaluate evaluate_all get_attribute "
    "inner_html inner_text input_value is_checked is_disabled is_enabled is_hidden is_visible "
    "text_content".split()
)
WAITS = frozenset(
    "becomes expect until wait_for wait_for_condition wait_for_event wait_for_load_state "
    "wait_for_url".split()
)
WORDS = tomllib.loads((HERE.parent / "templates/strings/en.toml").read_text(encoding="utf-8"))
PASSING = frozenset(
    {
        *("loading", WORDS["search"]["failed"]),
        *(WORDS["search"]["live"][key] for key in ("loading", "command_copied")),
        *(WORDS["code"][key] for key in ("copied", "failed")),
        *(WORDS["lab"]["live"][key] for key in ("log_copied", "link_copied", "link_shown")),
    }
)
"""States and texts that a page leaves by itself."""
SIGHT = re.compile(r"data-state|dataset\.state|textContent|innerText|text=|:text|has-text")
"""Marks of a script or a selector that looks at a state or a text."""
EXACT = frozenset(
    "to_have_accessible_name to_have_class to_have_count to_have_text to_have_title to_have_url "
    "to_have_value".split()
)
"""Expectations of which only one can hold at a time."""
Rule = Callable[[], Iterator[tuple[str, int]]]


@cache
def texts() -> dict[str, str]:
    """The tests' modules, by path."""
    paths = (path for path in sorted(HERE.rglob("*.py")) if path != Path(__file__))
    return {path.relative_to(HERE).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def trees(containing: str) -> dict[str, ast.Module]:
    """The modules in which a pattern is found."""
    paths = (path for path, text in texts().items() if re.search(containing, text))
    return {path: tree(path) for path in paths}


@cache
def tree(path: str) -> ast.Module:
    return ast.parse(texts()[path])


def called_name(node: ast.Call) -> str:
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def calls(node: ast.AST) -> Iterator[str]:
    """The names of what is called, but not in a function that is only handed on."""
    if isinstance(node, ast.Call):
        yield called_name(node)
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.Lambda | ast.FunctionDef):
            yield from calls(child)


def functions(tree: ast.Module) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def assertions_that_look_once() -> Iterator[tuple[str, int]]:
    for path, tree, helpers in page_modules():
        waits = with_helpers(WAITS, helpers)
        acts = with_helpers(ACTIONS, helpers) - waits
        for function in functions(tree):
            yield from ((path, line) for line in looks_once(function, waits, acts))


def waits_for_what_passes() -> Iterator[tuple[str, int]]:
    for path, tree, helpers in page_modules():
        acts = with_helpers(ACTIONS, helpers)
        for function in functions(tree):
            yield from ((path, line) for line in passes_unseen(function, acts))


def page_modules() -> Iterator[tuple[str, ast.Module, dict[str, set[str]]]]:
    """The modules that drive a browser, with what the helpers call that they can use."""
    pages = trees("playwright.sync_api")
    called = {path: helper_calls(tree) for path, tree in pages.items()}
    shared = {}
    for path, helpers in called.items():
        shared |= helpers if path.startswith("support/") else {}
    for path, tree in pages.items():
        yield path, tree, shared | called[path]


def helper_calls(tree: ast.Module) -> dict[str, set[str]]:
    """What the functions of a module call that are no tests."""
    return {
        function.name: {name for line in function.body for name in calls(line)}
        for function in functions(tree)
        if not function.name.startswith("test_")
    }


def with_helpers(names: frozenset[str], helpers: dict[str, set[str]]) -> frozenset[str]:
    """Names, and those of the functions that call one of them, or call such a function."""
    while additions := {name for name, called in helpers.items() if called & names} - names:
        names |= additions
    return names


def looks_once(
    function: ast.FunctionDef, waits: frozenset[str], acts: frozenset[str]
) -> Iterator[int]:
    """The lines of assertions that look at a page once after something was done to it."""
    has_acted = False
    for node in statements(function.body):
        called = set(calls(node))
        if called & waits:
            has_acted = False
        elif isinstance(node, ast.Assert) and has_acted and called & READINGS:
            yield node.lineno
        elif called & acts:
            has_acted = True


def passes_unseen(function: ast.FunctionDef, acts: frozenset[str]) -> Iterator[int]:
    """The lines that wait for what may be over before it is seen.

    That is what `PASSING` names, and a state after which another one of the same element is waited
    for with nothing done in between.
    """
    states: dict[str, tuple[int, str]] = {}
    for node in statements(function.body):
        inner = [call for call in ast.walk(node) if isinstance(call, ast.Call)]
        names = {called_name(call) for call in inner}
        texts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant)]
        if waits_for_presence(inner) and any(map(is_passing, texts)):
            yield node.lineno
        for subject, state in filter(None, map(awaited_state, inner)):
            line, before = states.get(subject, (0, state))
            if before != state:
                yield line
            states[subject] = node.lineno, state
        if names & acts or "write" in names:  # of a file, by the author
            states.clear()


def waits_for_presence(calls: list[ast.Call]) -> bool:
    """Whether a statement waits for something, and not only until it is gone."""
    awaited = [c for c in calls if called_name(c).startswith(("to_", "wait_for", "reach"))]
    awaited += [c for c in calls if called_name(c) in ("until", "becomes", "shows")]
    absent = ("to_be_hidden()", "to_have_count(0)", "state='hidden')", "state='detached')")
    return any(not ast.unparse(call).endswith(absent) for call in awaited)


def is_passing(text: object) -> bool:
    """Whether a text, a script, a selector or a pattern names what a page leaves by itself."""
    if not isinstance(text, str):
        return False
    is_named = any(re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text) for name in PASSING)
    return text.strip("^$") in PASSING or (is_named and SIGHT.search(text) is not None)


def awaited_state(call: ast.Call) -> tuple[str, str] | None:
    """The element whose state is waited for, as it is written, and the state."""
    match call:
        case ast.Call(ast.Name("reach" | "shows" | "becomes"), [*subject, ast.Constant() as state]):
            return ", ".join(map(ast.unparse, subject)), ast.unparse(state)
        case ast.Call(ast.Attribute(subject, "to_have_attribute"), [name, ast.Constant() as state]):
            return f"{ast.unparse(subject)}, {ast.unparse(name)}", ast.unparse(state)
        case ast.Call(ast.Attribute(subject, name), [ast.Constant() as state]) if name in EXACT:
            return f"{ast.unparse(subject)}, {name}", ast.unparse(state)
    return None


def statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Simple statements in their order; those of inner functions are theirs."""
    for node in body:
        blocks = [getattr(node, name, []) for name in ("body", "orelse", "finalbody")]
        if not any(blocks):
            yield node
        elif not isinstance(node, ast.FunctionDef | ast.ClassDef):
            for block in blocks:
                yield from statements(block)


def waits_for_time() -> Iterator[tuple[str, int]]:
    """Calls of `sleep` and `wait_for_timeout`, but in a loop, which looks for something.

    A sleep of a minute and more stands for something that hangs, and is never waited for; the host
    of the tests is slow when it is asked to be.
    """
    for path, tree in trees(r"sleep\(|wait_for_timeout\(").items():
        if path == "support/static_host.py":
            continue
        loops = [node for node in ast.walk(tree) if isinstance(node, ast.While | ast.For)]
        polling = {id(inner) for loop in loops for inner in ast.walk(loop)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and id(node) not in polling:
                time = [a.value for a in node.args if isinstance(a, ast.Constant)]
                if called_name(node) in ("sleep", "wait_for_timeout") and max(time, default=0) < 60:
                    yield path, node.lineno


def patches_of_private_names() -> Iterator[tuple[str, int]]:
    for path, tree in trees(r"setattr\(|patch\(|patch\.object\(").items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and called_name(node) in ("setattr", "patch", "object"):
                texts = [a.value for a in node.args[:2] if isinstance(a, ast.Constant)]
                names = [text.rpartition(".")[2] for text in texts if isinstance(text, str)]
                if any(name.startswith("_") and not name.startswith("__") for name in names):
                    yield path, node.lineno


ADVICE: dict[Rule, str] = {
    assertions_that_look_once: "use `expect`, `until` or `becomes`: the page may not be there yet",
    waits_for_what_passes: "wait for what comes of it, or note what passes with `note_changes`",
    waits_for_time: "wait for an event, or in a loop for a condition",
    patches_of_private_names: "test what can be seen, or give the product a parameter",
}
TO_MEND: dict[Rule, str] = {
    waits_for_time: "core/engine/test_page_pool.py",
    patches_of_private_names: "core/files/test_resources.py",
}
"""Files that do not keep a rule yet; the lists only become shorter."""


@pytest.mark.parametrize("rule", ADVICE, ids=lambda rule: rule.__name__)
def test_tests_are_free_of(rule: Rule) -> None:
    violations = list(rule())
    left = set(TO_MEND.get(rule, "").split())
    new = [f"tests/{path}:{line}: {ADVICE[rule]}" for path, line in violations if path not in left]
    assert new == [], "\n".join(new)
    mended = left - {path for path, _ in violations}
    assert mended == set(), "take these out of TO_MEND"


def test_lines_that_look_too_early_or_too_late_are_found(rewriting: bool) -> None:
    def render(case: Case) -> str:
        code = "def test(page, lab):\n" + indent(case.input, "    ")
        (function,) = functions(ast.parse(code))
        lines = [f"{line - 1} looks once" for line in looks_once(function, WAITS, ACTIONS)]
        lines += [f"{line - 1} may pass unseen" for line in passes_unseen(function, ACTIONS)]
        return "".join(f"{line}\n" for line in lines)

    check_cases(HERE / "fixtures/waits.md", render, rewriting=rewriting)
