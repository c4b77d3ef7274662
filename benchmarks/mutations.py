"""Change every number of the hard cases by a millionth, and count what is noticed.

Run: python benchmarks/mutations.py [FILE …] [--list END …] [--cases NAME …] [--every N] [--docs]

FILE is a module of `mjbench/mjbench/problems`, such as `tops`. Each number there but 0, also
in MJCF, is multiplied by 1 + 1e-6 in memory, one at a time; then the cases that it is part of are
checked as `coursebuild stability` checks them. A number ends in one of these ways:

- caught: two references, or theory and the engine's steps, differ by more than they may;
- refused: the cases do not run with it, as it is a count, an index or a name;
- a reason of `RULES`: it says how to look, and nothing that is true depends on it;
- no effect: motions stay where they are, as under another mass of what falls, and theory and
  engine still agree, with all figures that both have;
- figure: as before, but theory of a figure, or how it is measured, changes by less than a hundredth
  of what the two are apart, as where bodies are rigid in theory;
- missed: all others. They are listed, and so are those with an END.
"""

from __future__ import annotations

import argparse
import ast
import multiprocessing
import signal
import sys
import types
from collections import Counter
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import astuple, replace

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from benchmarks.measure.report import put_into  # noqa: E402
from benchmarks.slips.constants import RULES, WHOLE, Number, numbers_of  # noqa: E402
from mjbench import cases, measure  # noqa: E402
from mjbench.integrate import forward_motion  # noqa: E402
from mjbench.problem import Integrator, Motion, Problem, ScalarCheck, Sizes  # noqa: E402
from mjbench.reports.scene_report import FLOORS  # noqa: E402

DOCS = ROOT / "docs/explanation/numerics.md"
PACKAGE = "mjbench.problems"
FILES = ("oscillators", "tops", "tumbling_box", "contacts", "impact", "linked_bodies", "extremes")
"""In an order in which they can be imported."""
OFF = 1 + 1e-6
NOISE = 1e-12
"""Rounding, as of the velocity of a stone whose mass is another one."""
SECONDS = 300
"""How long the checks of a number may take."""
HORIZONS = {
    "chain-balls": 0.1,
    "chain-hinges": 0.1,
    "chain-heavy-tip": 1e-3,
    "double-pendulum": 0.5,
}
"""s: where references take long, the whole motion is looked at only if its beginning is not off."""

TREES: dict[str, ast.Module] = {}
CODES: dict[str, Any] = {}
FILE_OF: dict[str, str] = {}
BASES: dict[str, Base] = {}
"""Of each case as it is written."""


class Base(Struct, frozen=True):
    """What a changed case is compared with."""

    values: list[Any]
    motions: list[Motion]
    floor: Sizes
    lines: set[tuple[str, int]]
    """Those that its checks run through, by module."""
    figures: list[tuple[float, float]]
    """Measured under the first integrator, and in theory, where that is less precise."""


def load(codes: dict[str, Any]) -> dict[str, Problem]:
    """The hard cases of compiled modules."""
    problems: list[Problem] = []
    for file, code in codes.items():
        module = sys.modules[f"{PACKAGE}.{file}"] = types.ModuleType(f"{PACKAGE}.{file}")
        exec(code, module.__dict__)
        part = module.problems() if hasattr(module, "problems") else [module.problem()]
        FILE_OF.update({problem.name: file for problem in part})
        problems += part
    return {problem.name: problem for problem in problems}


def shorten(problem: Problem) -> Problem:
    duration = HORIZONS.get(problem.name, problem.scenario.duration)
    return replace(problem, scenario=replace(problem.scenario, duration=duration))


def values_of(problem: Problem) -> list[Any]:
    """What the motion depends on, and theory that is compared with the engine."""
    data = problem.mjcf, repr(problem.scenario), repr(problem.reference.solution)
    theory = [problem.limit(i) for i in Integrator] if problem.limit else []
    checks = precise_checks(problem)
    return [data, [theory, [check.expected(i) for check in checks for i in check.integrators]]]


def precise_checks(problem: Problem) -> list[ScalarCheck]:
    return [check for check in problem.checks if check.precision < float("inf")]


def figures_of(problem: Problem) -> list[tuple[float, float]]:
    """The other figures, measured and in theory."""
    pairs = [
        (check.measure(check.integrators[0]), check.expected(check.integrators[0]))
        for check in problem.checks
        if check.exact is not None and check.precision == float("inf")
    ]
    return [(figure, theory) for figure, theory in pairs if theory is not None]  # type: ignore[misc]


def motions_of(problem: Problem) -> list[Motion]:
    scenario, times = problem.scenario, problem.scenario.times
    second = problem.second.motion if problem.second else forward_motion
    first = measure.reference_motion(problem.reference, tuple(times.tolist()))
    return [first, second(problem.mjcf, scenario, times)]


def is_moved(problem: Problem, floors: float) -> bool:
    base = BASES[problem.name]
    pairs = zip(motions_of(problem), base.motions, strict=True)
    gaps = [astuple(measure.largest_errors(measure.errors(new, old))) for new, old in pairs]
    sizes = astuple(base.floor)
    return any(g > floors * max(f, NOISE) for gap in gaps for g, f in zip(gap, sizes, strict=True))


def check(problems: list[Problem]) -> None:
    """What `coursebuild stability` does before it says anything."""
    for problem in problems:
        cases.floor(problem)
    for problem in problems:
        cases.check_limits(problem)
        list(cases.measure_figures(problem, precise_checks(problem)))


def prepare(names: list[str]) -> None:
    """Compile the modules, and check cases of these names, or all, as they are."""
    for file in FILES:
        path = ROOT / "mjbench" / PACKAGE.replace(".", "/") / f"{file}.py"
        TREES[file] = ast.parse(path.read_text())
        CODES[file] = compile(TREES[file], file, "exec")
    problems = load(CODES)
    for problem in [shorten(problems[name]) for name in names or problems]:
        lines: set[tuple[str, int]] = set()

        def trace(frame: Any, *_: Any, lines: set[tuple[str, int]] = lines) -> Any:
            lines.add((frame.f_code.co_filename, frame.f_lineno))
            return trace if frame.f_code.co_filename in FILES else None

        sys.settrace(trace)
        check([problem])
        sys.settrace(None)
        values, figures = values_of(problem), figures_of(problem)
        base = Base(values, motions_of(problem), cases.floor(problem), lines, figures)
        BASES[problem.name] = base


def judge(number: Number) -> str:
    """How a number ends."""
    if number.reason:
        return number.reason
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.alarm(SECONDS)
    node: Any = list(ast.walk(TREES[number.file]))[number.node]
    value, (begin, end) = node.value, number.span or (0, 0)
    off = repr(float(number.text) * OFF)
    node.value = value[:begin] + off + value[end:] if number.span else value * OFF
    cases.floor.cache_clear()
    measure.reference_motion.cache_clear()
    try:
        whole = load(CODES | {number.file: compile(TREES[number.file], number.file, "exec")})
        problems = {name: shorten(whole[name]) for name in BASES}
        pairs = {name: (values_of(p), BASES[name].values) for name, p in problems.items()}
        changed = {name for name, (new, old) in pairs.items() if new != old}
        same_data = {name for name, (new, old) in pairs.items() if new[0] == old[0]}
        places = {(number.file, line) for line in number.lines}
        if len(same_data) < len(problems) and len(number.lines) == WHOLE:
            places = set()
        near = [name for name in problems if name in changed or BASES[name].lines & places]
        check([problems[name] for name in near])
        check([whole[name] for name in near if name in HORIZONS and is_moved(problems[name], 1.0)])
        suspects = [name for name in near if is_moved(problems[name], FLOORS)]
        related = {name for name in BASES if name in changed or FILE_OF[name] == number.file}
        names = sorted(same_data & related)
        figures = [] if suspects else compare_figures([problems[name] for name in names])
    except cases.DisagreementError:
        return "caught"
    except KeyboardInterrupt:
        return "missed"
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return "refused"
    if suspects or max(figures, default=0.0) > 0.01:
        return "missed"
    return "figure" if any(figures) else "no effect"


def compare_figures(problems: list[Problem]) -> list[float]:
    """By what part of the distance of measurement and theory these have changed."""
    parts = []
    for problem in problems:
        pairs = zip(figures_of(problem), BASES[problem.name].figures, strict=True)
        for (figure, theory), (old_figure, old_theory) in pairs:
            change = max(abs(figure - old_figure), abs(theory - old_theory))
            parts.append(change / abs(old_figure - old_theory))
    return parts


def summary(ends: Counter[str]) -> str:
    """The counts in words, for the manual."""
    aside = sum(ends[reason] for reason in RULES)
    return (
        f"Of {ends.total()} numbers of the hard cases, each changed by 10⁻⁶ "
        f"(`benchmarks/mutations.py`), {ends['caught']} are caught, {ends['refused']} (counts, "
        f"indices) let nothing run, {ends['no effect']} change nothing, {ends['figure']} a "
        f"figure by under a hundredth of its distance from theory, {aside} say how to look, "
        f"{ends['missed']} are missed."
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", metavar="FILE", default=FILES)
    parser.add_argument("--list", nargs="+", default=[], metavar="END")
    parser.add_argument("--cases", nargs="+", default=[], metavar="NAME", help="only these")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each N-th number")
    parser.add_argument("--docs", action="store_true", help=f"put the counts into {DOCS.name}")
    arguments = parser.parse_args()
    prepare(arguments.cases)
    numbers = [number for file in arguments.files for number in numbers_of(file, TREES[file])]
    numbers = numbers[:: arguments.every]
    ends: dict[str, Counter[str]] = {file: Counter() for file in arguments.files}
    with multiprocessing.get_context("fork").Pool(2, maxtasksperchild=1) as pool:
        for number, end in zip(numbers, pool.imap(judge, numbers), strict=True):
            ends[number.file][end] += 1
            if end == "missed" or end in arguments.list:
                print(f"{end}: {number.file}.py:{number.line}: {number.text}", flush=True)
    total = sum(ends.values(), Counter())
    print(f"{'':20}" + "".join(f"{name:>14}" for name in (*ends, "all")))
    for end in ("caught", "refused", "no effect", "figure", *RULES, "missed"):
        print(f"{end:20}" + "".join(f"{part[end]:14}" for part in (*ends.values(), total)))
    if arguments.docs:
        put_into(DOCS, summary(total))
    return 1 if total["missed"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
