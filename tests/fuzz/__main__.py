"""`python -m fuzz`: the targets one after the other; exit status 1 where something was found."""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from fuzz.attempts import WORST
from fuzz.targets import TARGETS, WORDS
from fuzz.texts import ROOT

CORPUS = Path(__file__).parent / "corpus"
MAX_INPUTS = 40
"""Inputs that the corpus of a target may have."""
HANGS, MEMORY = 120, 2048
"""Seconds, by the clock, and MiB after which an input ends its worker. Before these there are the
limits of `attempts`; a computation in C hears nothing of them."""
_EXECUTION_COUNT = re.compile(r"stat::number_of_executed_units: (\d+)")
_COVERED_EDGES = re.compile(r" cov: (\d+)")


class Outcome(NamedTuple):
    """What became of a target."""

    inputs: int
    edges: int
    """Of the code that were reached."""
    findings: list[str]
    seconds: float
    """Processor time of the input that took longest."""
    memory: float
    """MiB of the one that took most."""


class Bench:
    """The folder of a target: `seeds`, `corpus`, and what was found."""

    def __init__(self, name: str, top: Path) -> None:
        self.name = name
        self.folder = top / name
        shutil.rmtree(self.folder, ignore_errors=True)
        for part in ("seeds", "corpus", "temporary"):
            (self.folder / part).mkdir(parents=True)
        for number, seed in enumerate(first_inputs(name)):
            (self.folder / f"seeds/{number:04d}").write_bytes(seed)
        (self.folder / "words").write_text(dictionary())

    def attempt(self, seconds: int, runs: int, seed: int) -> Outcome:
        """Try inputs for so long, or so many; a worker that was ended is followed by another."""
        until = time.monotonic() + seconds
        inputs = edges = 0
        while (left := until - time.monotonic()) > 0 and (not runs or inputs < runs):
            budget = f"-runs={runs - inputs}" if runs else f"-max_total_time={left:.0f}"
            status, output = self.worker(budget, f"-seed={seed + inputs}", "corpus", "seeds")
            executed = _EXECUTION_COUNT.findall(output)
            if not executed:
                raise SystemExit(f"{output[-3000:]}\nthe worker of `{self.name}` ended: {status}")
            inputs += max(int(executed[-1]), 1)
            edges = max([edges, *map(int, _COVERED_EDGES.findall(output))])
            if status == 0:
                break
        worst = self.folder / WORST
        seconds, memory = json.loads(worst.read_text()) if worst.exists() else (0.0, 0.0)
        return Outcome(inputs, edges, self.findings(), seconds, memory)

    def worker(self, *options: str) -> tuple[int, str]:
        command = [sys.executable, "-m", "fuzz.worker", self.name, ".", "-dict=words"]
        command += [f"-timeout={HANGS}", f"-rss_limit_mb={MEMORY}", "-max_len=4096"]
        command += ["-report_slow_units=1000000"]  # by the clock: `attempts` measures better
        command += ["-print_final_stats=1", "-verbosity=1", *options]
        paths = {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}", "PATH": ""}
        paths |= dict.fromkeys(("TMPDIR", "XDG_STATE_HOME"), str(self.folder / "temporary"))
        process = subprocess.run(
            command, cwd=self.folder, env=paths, capture_output=True, text=True, errors="replace"
        )
        return process.returncode, process.stderr

    def findings(self) -> list[str]:
        """What was found, a line each with where its input lies."""
        lines = []
        for path in sorted(self.folder.iterdir()):
            kind, dash, _ = path.name.partition("-")
            if dash and not path.suffix:
                note = path.with_suffix(".json")
                title = json.loads(note.read_text())[0] if note.exists() else kind
                lines.append(f"{title}: {path}")
        return lines

    def keep(self) -> None:
        """Put the shortest inputs that reached new code into the corpus of the repository."""
        inputs = {path.read_bytes() for path in (self.folder / "corpus").iterdir()}
        new_inputs = inputs.union(read_corpus(self.name)).difference(TARGETS[self.name].seeds())
        least = sorted(new_inputs, key=lambda data: (len(data), data))[:MAX_INPUTS]
        text = json.dumps([data.decode("latin-1") for data in least], indent=0)
        (CORPUS / f"{self.name}.json").write_text(f"{text}\n")


def read_corpus(name: str) -> list[bytes]:
    """The corpus of a target; `NAME-found`: inputs that showed a mistake once."""
    path = CORPUS / f"{name}.json"
    texts = json.loads(path.read_text()) if path.exists() else ()
    return [text.encode("latin-1") for text in texts]


def first_inputs(name: str) -> list[bytes]:
    """From which a target begins."""
    return [*TARGETS[name].seeds(), *read_corpus(name), *read_corpus(f"{name}-found")]


def dictionary() -> str:
    """The words, as libFuzzer reads them."""
    words = ("".join(f"\\x{byte:02x}" for byte in word) for word in WORDS)
    return "".join(f'"{word}"\n' for word in words)


def write_seeds(folder: Path) -> None:
    """Write the first inputs and words of each target, by the names that OSS-Fuzz gives them."""
    for name in TARGETS:
        (folder / f"fuzz_{name}.dict").write_text(dictionary())
        with zipfile.ZipFile(folder / f"fuzz_{name}_seed_corpus.zip", "w") as archive:
            for number, seed in enumerate(first_inputs(name)):
                archive.writestr(f"{number:04d}", seed)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--seconds", type=int, default=600, help="in all")
    parser.add_argument("--runs", type=int, default=0, help="inputs of each target")
    parser.add_argument("--seed", type=int, default=int(time.time()) % 10**8)
    parser.add_argument("--keep", action="store_true", help="add to the corpus")
    parser.add_argument("--out", type=Path, default=ROOT / "build/fuzz")
    parser.add_argument("--write-seeds", type=Path, metavar="FOLDER", help="for OSS-Fuzz, no more")
    options = parser.parse_args(arguments)
    if options.write_seeds is not None:
        write_seeds(options.write_seeds)
        return 0
    names = options.targets or [*TARGETS]
    findings = []
    print(
        f"seed {options.seed}\n{'target':14}{'tried':>10}{'survived':>10}{'found':>7}{'edges':>8}"
        f"{'at most, s':>12}{'MiB':>7}"
    )
    for name in names:
        bench = Bench(name, options.out.resolve())
        seconds = 10**6 if options.runs else options.seconds // len(names)
        outcome = bench.attempt(seconds, options.runs, options.seed)
        survived = outcome.inputs - len(outcome.findings)
        print(
            f"{name:14}{outcome.inputs:10}{survived:10}{len(outcome.findings):7}{outcome.edges:8}"
            f"{outcome.seconds:12.2f}{outcome.memory:7.0f}"
        )
        sys.stdout.flush()
        findings += outcome.findings
        if options.keep:
            bench.keep()
    print("\n".join(findings) or "nothing was found")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
