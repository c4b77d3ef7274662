r"""Hold the arithmetic of formulas against SymPy, on equalities and identities that nobody wrote.

Run: python benchmarks/equalities.py [--count 10000] [--seed 1] [--kinds KIND …]

Formulas are made by kinds, half of them false: sums that cancel, zeros and poles, roots and inverse
functions on either branch, results that are off by one in their last digit or less, identities that
hold on one side only, units, commas, matrices and other notations. Each is written in TeX and,
independently of our reader, as an expression of SymPy, which says at 60 digits whether it is true.
A verdict of `coursebuild` is false if SymPy says otherwise; where it says "not computed", nothing
is decided. What has no value, or no certain meaning, is not to be judged.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]

from benchmarks.formulas import functions, notations, symbols, values  # noqa: E402
from benchmarks.formulas.terms import Case  # noqa: E402
from coursebuild.features.arithmetic.chains import check_arithmetic  # noqa: E402
from coursebuild.features.arithmetic.identities import check_identity, read_domain  # noqa: E402

KINDS = (*values.KINDS, *symbols.KINDS, *notations.KINDS, *functions.KINDS)


def make_cases(
    count: int, seed: int, kinds: Sequence[Callable[[random.Random], Case]] = KINDS
) -> Iterator[Case]:
    """Make formulas, as many of each kind."""
    rng = random.Random(seed)
    for number in range(count):
        yield kinds[number % len(kinds)](rng)


def judge(case: Case) -> bool | None:
    """Whether the tool holds a formula to be true; `None` if it does not tell."""
    if case.domain is None:
        kinds = {comparison.kind for comparison in check_arithmetic(case.tex, comma=case.comma)}
    else:
        comparisons = check_identity(case.tex, {"x": (), "y": ()}, read_domain(case.domain))
        kinds = {comparison.kind for comparison in comparisons} or {"holds"}
    if "wrong" in kinds:
        return False
    return True if kinds == {"holds"} else None


def main() -> None:
    """Print false verdicts, and how much is decided, by kind."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    names = [kind.__name__ for kind in KINDS]
    parser.add_argument("--kinds", nargs="+", choices=names, default=names, metavar="KIND")
    options = parser.parse_args()
    kinds = [kind for kind in KINDS if kind.__name__ in options.kinds]
    counts: dict[str, Counter[str]] = {kind.__name__: Counter() for kind in kinds}
    seconds: Counter[str] = Counter()
    for case in make_cases(options.count, options.seed, kinds):
        start = time.perf_counter()
        verdict = judge(case)
        seconds[case.kind] += time.perf_counter() - start
        row = counts[case.kind]
        row["all"] += 1
        row[str(case.truth)] += 1
        row["decided"] += verdict is not None
        if verdict is not None and verdict is not case.truth:
            row["false"] += 1
            print(f"false verdict: {verdict}, SymPy: {case.truth}: {case.tex}  {case.domain or ''}")
    titles = ("kind", "all", "true", "false", "no value", "decided", "wrong", "ms")
    print("{:<14}{:>7}{:>7}{:>7}{:>10}{:>9}{:>7}{:>8}".format(*titles))
    for kind, row in (*counts.items(), ("all", sum(counts.values(), Counter()))):
        time_spent = seconds[kind] if kind != "all" else seconds.total()
        share = f"{100 * row['decided'] / max(row['all'] - row['None'], 1):.1f} %"
        print(
            f"{kind:<14}{row['all']:>7}{row['True']:>7}{row['False']:>7}{row['None']:>10}{share:>9}"
            f"{row['false']:>7}{1000 * time_spent / max(row['all'], 1):>8.2f}"
        )


if __name__ == "__main__":
    main()
