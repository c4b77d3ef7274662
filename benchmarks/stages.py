"""What each stage of a build costs, beside what a user would take instead.

Run: python benchmarks/stages.py [--course DIR] [--repeat N]

Each line is the minimum of several repeats, interleaved so that a slow moment of the machine hits
all alike, with the median beside it; ratios are of minima.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from coursebuild.checks import course_formulas
from coursebuild.effects.resources import bundled_files, template_texts
from coursebuild.effects.store import kept
from coursebuild.effects.v8 import MathEngine
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.verify import extract_scripts, run, verify
from coursebuild.render.assets import Assets
from coursebuild.render.fonts import FontJob, subset_font
from coursebuild.render.site import SiteOptions, render_site
from coursebuild.syntax.document import parse_document


def timed(candidates: dict[str, Callable[[], object]], repeat: int) -> dict[str, list[float]]:
    """Seconds of each candidate, interleaved."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(repeat):
        for name, work in candidates.items():
            began = time.perf_counter()
            work()
            seconds[name].append(time.perf_counter() - began)
    return seconds


def show(title: str, seconds: dict[str, list[float]], base: str) -> None:
    """A table: minimum, median, ratio to the base."""
    print(f"\n{title}")
    for name, values in seconds.items():
        low = min(values)
        ratio = low / min(seconds[base])
        middle = statistics.median(values)
        print(f"  {name:<44} {1e3 * low:9.2f} ms  median {1e3 * middle:9.2f}  x {ratio:6.2f}")


def parsing(root: Path, repeat: int) -> None:
    """Our parser beside the library that it stands on."""
    from markdown_it import MarkdownIt

    course = load(root).course
    assert course is not None
    sources = [document.source for document in course.documents]
    kinds = frozenset(kind.name for kind in course.callouts)
    bare = MarkdownIt("commonmark").enable(["table", "strikethrough"])
    size = sum(len(source.text.encode()) for source in sources)
    candidates = {
        "markdown-it-py, tokens only": lambda: [bare.parse(s.text) for s in sources],
        "parse_document: tree, places, diagnostics": lambda: [
            parse_document(s, kinds, lesson=False) for s in sources
        ],
    }
    show(f"parsing {size / 1e3:.0f} kB", timed(candidates, repeat), "markdown-it-py, tokens only")


def scripts(root: Path, repeat: int) -> None:
    """Our runner beside bare Python."""
    options = Options(root, len(os.sched_getaffinity(0)), True)
    course = load(root).course
    assert course is not None
    chosen = extract_scripts(course, options).runnable

    def bare() -> None:
        for e in chosen:
            subprocess.run([sys.executable, e.path], cwd=root, capture_output=True, check=True)

    candidates: dict[str, Callable[[], object]] = {
        "python, one after the other": bare,
        f"coursebuild, {options.jobs} at a time": lambda: run(
            chosen, options, Progress(quiet=True)
        ),
    }
    seconds = timed(candidates, max(2, repeat // 3))
    show(f"running {len(chosen)} scripts", seconds, "python, one after the other")


def stages(root: Path, repeat: int) -> None:
    """The rest of a build."""
    options = Options(root, 1, True)
    course = load(root).course
    assert course is not None
    results = verify(course, options, Progress(quiet=True)).results
    assets = Assets(template_texts(), bundled_files())

    def subset(job: FontJob) -> bytes:
        return kept(root, "fonts", job.key, lambda: subset_font(job))

    def typeset() -> None:
        with MathEngine() as engine:
            engine.typeset(course_formulas(course))

    candidates: dict[str, Callable[[], object]] = {
        "load: read, parse, check": lambda: load(root),
        f"typeset {len(course_formulas(course))} formulas": typeset,
        "render, fonts kept": lambda: render_site(
            course, results, assets, SiteOptions(subset=subset)
        ),
    }
    show("stages", timed(candidates, max(2, repeat // 2)), "load: read, parse, check")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    here = Path(__file__).resolve().parents[1]
    parser.add_argument("--course", type=Path, default=here)
    parser.add_argument("--repeat", type=int, default=9)
    arguments = parser.parse_args()
    root = arguments.course.resolve()
    print(f"{platform.platform()}, {len(os.sched_getaffinity(0))} cores, {platform.processor()}")
    names = ("markdown-it-py", "mujoco", "numpy")
    print(f"Python {platform.python_version()}, " + ", ".join(f"{n} {version(n)}" for n in names))
    parsing(root, arguments.repeat)
    scripts(root, arguments.repeat)
    stages(root, arguments.repeat)


if __name__ == "__main__":
    main()
