"""What each part of the house weighs, and may weigh: `budgets.toml`, which also says why.

Python weighs the nodes of its syntax trees, so that neither comments nor denser lines count;
JavaScript its words and signs outside comments. `pytest tests/test_budgets.py --rewrite-budgets`
lowers the numbers to what stands, and sets those that are not there; none is ever raised by it.
`python tests/test_budgets.py` prints what weighs what, and who asked for it.
"""

from __future__ import annotations

import ast
import importlib
import re
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from coursebuild import api
from support.run_code import run_code
from support.scratch_course import Make

ROOT = Path(__file__).parents[1]
FILE = Path(__file__).with_name("budgets.toml")
_JAVASCRIPT = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|[\w$]+|[^\s\w]""",
    re.DOTALL,
)


def part_of(path: Path) -> str:
    """The part of the house that a file belongs to."""
    names = path.relative_to(ROOT).parts
    depth = {"coursebuild": 2, "mjbench": 1, "site": 2}.get(names[0], 1)
    if names[:2] in (("coursebuild", "core"), ("coursebuild", "features")):
        depth = 3
    if names[:2] == ("mjbench", "tests"):
        return "tests"
    return "/".join(names[: min(depth, len(names) - 1)])


@cache
def weights() -> Counter[str]:
    parts: Counter[str] = Counter()
    for folder in ("coursebuild", "mjbench", "mjcourse", "plugins", "tests"):
        for path in (ROOT / folder).rglob("*.py"):
            if not {".venv", "build", "courses"} & set(path.parts):
                parts[part_of(path)] += len([*ast.walk(ast.parse(path.read_bytes()))])
    for path in (ROOT / "site/js").rglob("*.js"):
        tokens = _JAVASCRIPT.finditer(path.read_text(encoding="utf-8"))
        parts[part_of(path)] += sum(not token["comment"] for token in tokens)
    return parts


def is_offered(module: str, name: str) -> bool:
    """Whether a name of a module is one of the interface."""
    if not hasattr(api, name):
        return False
    value = getattr(importlib.import_module(module), name, None)
    if value is None:
        value = importlib.import_module(f"{module}.{name}")
    return value is getattr(api, name)


@cache
def imports_of_features() -> dict[str, frozenset[tuple[str, str, str]]]:
    """By feature: each file, with the modules and names of the tool that it imports."""
    imports: dict[str, set[tuple[str, str, str]]] = {}
    for path in (ROOT / "coursebuild/features").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            top, *rest = node.module.split(".")
            if top == "coursebuild" and rest[:1] != ["features"] and rest != ["api"]:
                imports.setdefault(part_of(path), set()).update(
                    (path.name, node.module, alias.name) for alias in node.names
                )
    return {part: frozenset(entries) for part, entries in imports.items()}


def count_internals(part: str) -> int:
    """How many names a feature imports that the interface does not offer."""
    imports = imports_of_features().get(part, frozenset())
    return len({(module, name) for _, module, name in imports})


def measurements() -> dict[str, dict[str, int]]:
    return {
        part: {"most": weight}
        | ({"internals": count_internals(part)} if part.startswith("coursebuild/features/") else {})
        for part, weight in sorted(weights().items())
    }


def rewritten(text: str) -> str:
    """The budgets, lowered to what stands; a number that is not there is entered."""

    def entry(match: re.Match[str]) -> str:
        budget = tomllib.loads(match[0])[match[1]]
        numbers = {
            key: min(number, budget.get(key, number))
            for key, number in measurements().get(match[1], {}).items()
        }
        head = "".join(f"{key} = {number}, " for key, number in numbers.items())
        return f'"{match[1]}" = {{ {head}why = {match[2]}'

    return re.sub(r'(?m)^"(.+?)" = \{ (?:\w+ = \d+, )*why = (.*)$', entry, text)


def test_no_part_weighs_more_than_its_budget(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--rewrite-budgets"):
        FILE.write_text(rewritten(FILE.read_text(encoding="utf-8")), encoding="utf-8")
    budgets = tomllib.loads(FILE.read_text(encoding="utf-8"))
    entries = budgets.pop("ledger")
    budgets.pop("loaded")
    assert sorted(budgets) == sorted(measurements()), (
        'a part needs a line `"PART" = { why = "…" }`; --rewrite-budgets then enters its numbers'
    )
    violations = [
        f"{part}: {key} is {number}, and may be {budgets[part][key]}"
        for part, numbers in measurements().items()
        for key, number in numbers.items()
        if number > budgets[part][key]
    ]
    advice = "join or remove something; else raise the number in budgets.toml, and say there why"
    assert not violations, "\n".join([*violations, advice])
    assert [part for part, budget in budgets.items() if not budget["why"].strip()] == []
    assert [entry for entry in entries if {*entry} != {"issue", "what", "weight"}] == []


@pytest.mark.site
def test_a_check_of_one_line_loads_no_more_modules_than_before(make: Make) -> None:
    folder = make("One line.\n")
    done = run_code(
        "import sys\n"
        "from coursebuild.cli import main\n"
        f"main(['-C', {str(folder.root)!r}, 'check', '--no-cache'])\n"
        "print(sum(name.split('.')[0] == 'coursebuild' for name in sys.modules))"
    )
    report, modules = done.stdout.splitlines()[-2:]
    assert report == "1 lesson, 0 scripts run: everything holds"
    budget = tomllib.loads(FILE.read_text(encoding="utf-8"))["loaded"]["modules"]
    assert int(modules) <= budget, done.stdout


def test_features_import_from_the_interface_what_it_offers() -> None:
    violations = [
        f"{part}: {file} imports {name} from {module}, and not from coursebuild.api"
        for part, imports in sorted(imports_of_features().items())
        for file, module, name in sorted(imports)
        if is_offered(module, name)
    ]
    assert not violations, "\n".join(violations)


def test_budgets_are_lowered_and_never_raised() -> None:
    part, number = next(iter(weights().items()))
    text = '"{}" = {{ {}why = "it is there" }}\n'
    stands = text.format(part, f"most = {number}, ")
    assert rewritten(text.format(part, f"most = {number + 1}, ")) == stands
    lower = text.format(part, f"most = {number - 1}, ")
    assert rewritten(lower) == lower
    assert rewritten(text.format(part, "")) == stands


def print_table() -> None:
    """What each part weighs and why; what each change has added, and the issue that asked."""
    budgets = tomllib.loads(FILE.read_text())
    for part, weight in weights().most_common():
        print(weight, part, budgets[part]["why"], sep="\t")
    for entry in sorted(budgets["ledger"], key=lambda entry: -entry["weight"]):
        print(entry["weight"], entry["issue"], entry["what"], sep="\t")


if __name__ == "__main__":
    print_table()
