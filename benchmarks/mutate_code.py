"""Which changes of the code no test notices.

    .venv/bin/python benchmarks/mutate_code.py --seed 1 --count 20

Each change is of one expression or statement, drawn uniformly over `coursebuild/core` and
`coursebuild/pipeline`, and is made in a copy of the repository. First the tests run that import the
module, then those of its folder with the fixtures of rules that need no engine, then those of the
pipeline. A change counts as noticed where a test fails that passes without it. What survives is
listed, for a human to judge: some change nothing.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("coursebuild/core", "coursebuild/pipeline")
UNMEASURED = "not (browser or engine or long or slow)"
SECONDS = 1200
COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}


class Mutant(NamedTuple):
    """A change of a file between two offsets of its bytes."""

    path: str
    line: int
    start: int
    end: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: `{self.old}` → `{self.new}`"


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """Other nodes in place of one."""
    match node:
        case ast.Compare(ops=[op]):
            yield _with(node, ops=[COMPARISONS[type(op)]()])
        case ast.BoolOp(op, values):
            yield _with(node, op=ast.Or() if isinstance(op, ast.And) else ast.And())
            for at in range(len(values)):
                rest = [*values[:at], *values[at + 1 :]]
                yield _with(node, values=rest) if rest[1:] else rest[0]
        case ast.UnaryOp(ast.Not(), operand):
            yield operand
        case ast.BinOp(op=ast.Add()):
            yield _with(node, op=ast.Sub())
        case ast.BinOp(op=ast.Sub()):
            yield _with(node, op=ast.Add())
        case ast.Constant(bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(int() as value):
            yield ast.Constant(value + 1)
        case ast.IfExp(_, body, orelse):
            yield from (body, orelse)
        case ast.Call(ast.Name("all" | "any" as name), args):
            yield ast.Call(ast.Name("any" if name == "all" else "all"), args, [])
        case ast.comprehension(ifs=[_, *_]):
            yield _with(node, ifs=node.ifs[1:])
        case ast.Expr(ast.Call()) | ast.AugAssign() | ast.Continue() | ast.Break():
            yield ast.Pass()


def _with(node: ast.AST, **fields: object) -> ast.AST:
    new = copy.copy(node)
    for name, value in fields.items():
        setattr(new, name, value)
    return new


def mutants(path: Path) -> Iterator[Mutant]:
    """All changes of a file."""
    source = path.read_bytes()
    starts = [0]
    for line in source.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    tree = ast.parse(source)
    ignored = {
        id(part)
        for node in ast.walk(tree)
        for hint in (getattr(node, "annotation", None), getattr(node, "returns", None))
        if hint is not None
        for part in ast.walk(hint)
    }
    for node in ast.walk(tree):
        place = node.iter if isinstance(node, ast.comprehension) else node
        if id(node) in ignored or not isinstance(place, ast.expr | ast.stmt):
            continue
        last = node.ifs[-1] if isinstance(node, ast.comprehension) and node.ifs else place
        start = starts[place.lineno - 1] + place.col_offset
        end = starts[(last.end_lineno or 1) - 1] + (last.end_col_offset or 0)
        old = source[start:end].decode()
        for new_node in changes(node):
            new = ast.unparse(ast.fix_missing_locations(new_node))
            if isinstance(node, ast.comprehension):
                new = new.partition(" in ")[2]
            elif isinstance(node, ast.expr):
                new = f"({new})"
            yield Mutant(str(path.relative_to(ROOT)), place.lineno, start, end, old, new)


def tests_of(path: str) -> Iterator[tuple[str, ...]]:
    """The tests that import a module, those of its folder with the rules, those of the pipeline."""
    module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, name = module.rpartition(".")
    imported = re.compile(rf"{re.escape(module)}\b|from {re.escape(package)} import .*\b{name}\b")
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    stages = [[file for file in files if imported.search(file.read_text("utf-8"))]]
    for folder in (Path(path).parent.relative_to("coursebuild"), Path("pipeline")):
        stages.append([file for file in files if file.is_relative_to(ROOT / "tests" / folder)])
    stages[1].append(ROOT / "tests/core/text/test_rules.py")
    earlier_files: set[Path] = set()
    for stage in stages:
        if new := [file for file in stage if file not in earlier_files]:
            yield tuple(str(file.relative_to(ROOT)) for file in new)
        earlier_files |= {*stage}


class Copy:
    """A copy of the repository, in which tests run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        words = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        listing = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
        for name in filter(None, listing.stdout.split("\0")):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
        shutil.copytree(ROOT / "site/dist", folder / "site/dist")
        self.time = int(time.time())
        self.failing: list[str] = []  # as options that leave out these tests, also without a change

    def first_failure(self, tests: Iterable[str], *options: str) -> str:
        """The first test that fails; empty where none does."""
        words = ["-q", "-x", "-p", "no:cacheprovider", "-m", UNMEASURED, *options, *tests]
        paths = os.pathsep.join((str(self.folder), str(self.folder / "tests")))
        variables = {**os.environ, "PYTHONPATH": paths}
        try:
            result = subprocess.run(
                (sys.executable, "-m", "pytest", *words),
                cwd=self.folder,
                env=variables,
                capture_output=True,
                text=True,
                timeout=SECONDS,
            )
        except subprocess.TimeoutExpired:
            return "they do not come to an end"
        failure = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", result.stdout, re.MULTILINE)
        if result.returncode not in (0, 5) and not failure:
            return "they cannot be run"
        return failure[0] if failure else ""

    def write(self, file: Path, data: bytes) -> None:
        """Write a module, with a time by which Python knows that it was compiled before."""
        self.time += 10
        file.write_bytes(data)
        os.utime(file, (self.time, self.time))

    def try_out(self, mutant: Mutant) -> str:
        """A test that notices a change, and passes without it; empty where none does."""
        file = self.folder / mutant.path
        source = file.read_bytes()
        changed = source[: mutant.start] + mutant.new.encode() + source[mutant.end :]
        for tests in tests_of(mutant.path):
            while True:
                self.write(file, changed)
                failure = self.first_failure(tests, *self.failing)
                self.write(file, source)
                if not failure:
                    break
                if "::" not in failure or not self.first_failure([failure]):
                    return failure
                self.failing.append(f"--deselect={failure}")
        return ""


def main() -> None:
    """Draw, try and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=20)
    arguments = parser.parse_args()
    files = sorted(file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py"))
    candidates = [mutant for file in files for mutant in mutants(file)]
    sample = random.Random(arguments.seed).sample(candidates, arguments.count)
    print(f"{arguments.count} of {len(candidates)} changes, seed {arguments.seed}", flush=True)
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        place = Copy(Path(folder))
        for number, mutant in enumerate(sample, 1):
            test = place.try_out(mutant)
            survivors += not test
            print(f"{number:3} {mutant}\n    {test or 'SURVIVES'}", flush=True)
    print(f"{survivors} of {arguments.count} survive")


if __name__ == "__main__":
    main()
