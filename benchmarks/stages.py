"""The cost of each stage of a build, compared with what a user would take instead.

Run: python benchmarks/stages.py [--course DIR] [--repeat N]

Each line is the minimum of several repeats, interleaved so that a slow moment of the machine hits
all alike, with the median beside it; ratios are of minima.
"""

from __future__ import annotations

import argparse
import gc
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.checks.formulas import document_formulas
from coursebuild.core.engine.store import Store
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Course
from coursebuild.core.model.results import Formula, MathError, Reports, Results
from coursebuild.core.model.walk import without_prose
from coursebuild.core.pages import listings
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageHead
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.page_writer import draw
from coursebuild.core.pages.record import record
from coursebuild.core.run import gate
from coursebuild.core.run.script_environment import cpu_name
from coursebuild.core.run.typesetting import MathEngine
from coursebuild.core.syntax import python_syntax
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.python_code import find_imports
from coursebuild.core.values import encode
from coursebuild.features.language_server.commands.diagnosis import current_diagnostics
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scripts import extract_scripts, run
from coursebuild.pipeline.site import Site
from coursebuild.pipeline.verify import verify
from coursebuild.preview.rebuild import BackgroundRebuild
from coursebuild.preview.session import Session
from coursebuild.report import Style


def time_candidates(
    candidates: dict[str, Callable[[], object]],
    repeat: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, list[float]]:
    """Seconds of each candidate, interleaved."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(repeat):
        for name, work in candidates.items():
            start = clock()
            work()
            seconds[name].append(clock() - start)
    return seconds


def show(title: str, seconds: dict[str, list[float]], base: str) -> None:
    """A table: minimum, median, ratio to the base."""
    print(f"\n{title}")
    for name, values in seconds.items():
        low = min(values)
        ratio = low / min(seconds[base])
        middle = statistics.median(values)
        print(f"  {name:<44} {1e3 * low:9.2f} ms  median {1e3 * middle:9.2f}  x {ratio:6.2f}")


def measure_parsing(root: Path, repeat: int) -> None:
    """Our parser compared with the library that it uses."""
    from markdown_it import MarkdownIt

    course = load(root).value
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
    show(
        f"parsing {size / 1e3:.0f} kB",
        time_candidates(candidates, repeat),
        "markdown-it-py, tokens only",
    )


def measure_typing(root: Path, repeat: int) -> None:
    """The cost of one more word in the longest lesson for the language server: time of one core."""
    from markdown_it import MarkdownIt

    session = Session(Options(root, 1, Store(root)), site=False)
    rebuild = BackgroundRebuild(session, Style())
    session.start()
    rebuild.run_once()
    assert session.course is not None
    sources = [
        lesson.document.source for lesson in session.course.lessons if lesson.document is not None
    ]
    longest = max(sources, key=lambda source: len(source.text))
    bare = MarkdownIt("commonmark").enable(["table", "strikethrough"])

    def read() -> None:
        text = session.open_texts.get(longest.path, longest.text + "\n")
        session.open_texts = {longest.path: f"{text}word "}
        session.edit([longest.path], is_saved=False)

    candidates: dict[str, Callable[[], object]] = {
        "markdown-it-py, tokens only": lambda: bare.parse(longest.text),
        "read and check the text": read,
        "compare it with what scripts printed": lambda: current_diagnostics(session),
    }
    seconds = time_candidates(candidates, max(2, repeat), time.process_time)
    show(f"a word in {len(longest.text) / 1e3:.0f} kB", seconds, "markdown-it-py, tokens only")
    rebuild.close()
    session.close()


def measure_scripts(root: Path, repeat: int) -> None:
    """Our runner compared with bare Python."""
    options = Options(root, len(os.sched_getaffinity(0)), Store(root))
    course = load(root).value
    assert course is not None
    runnable = extract_scripts(course, options).runnable

    def bare() -> None:
        for e in runnable:
            command, variables = [sys.executable, e.path], {**os.environ}
            done = gate.finish(command, variables, folder=root, bound=False)
            assert done.status == 0, done.errors

    candidates: dict[str, Callable[[], object]] = {
        "python, one after the other": bare,
        f"coursebuild, {options.jobs} at a time": lambda: run(
            runnable, options, run_store=options.run_store(fresh=True)
        ),
    }
    seconds = time_candidates(candidates, max(2, repeat // 3))
    show(f"running {len(runnable)} scripts", seconds, "python, one after the other")


def measure_stages(course: Course, results: Results, root: Path, repeat: int) -> None:
    """The other stages of a build."""
    options = Options(root, 1, Store(root))

    def make_files() -> None:
        with Reader(options) as reader:
            loaded_course = load(root, reader).value
            assert loaded_course is not None
            assets = Assets(template_texts(), Bundle(), prepared_folder())
            library = make_library(loaded_course, results, assets, Reports())
            for file in Site(library, reader, options).files:
                file.make()

    candidates: dict[str, Callable[[], object]] = {
        "load: read, parse, check": lambda: load(root),
        "typeset all formulas": lambda: typeset(course),
        "load from the store and make all files": make_files,
    }
    show("stages", time_candidates(candidates, max(2, repeat // 2)), "load: read, parse, check")


def typeset(course: Course) -> tuple[tuple[Formula, str | MathError], ...]:
    """The formulas of a course with their MathML, from a fresh engine."""
    formulas = tuple(dict.fromkeys(f for d in course.documents for f in document_formulas(d)))
    return tuple(zip(formulas, MathEngine().typeset(formulas), strict=True))


def measure_lessons(course: Course, results: Results, repeat: int) -> None:
    """The cost of each step for a lesson: time of one core, without caches between lessons."""
    library = make_library(course, results, Assets(template_texts(), Bundle()), Reports())
    pages = [
        (page.inputs(library), document)
        for page in page_list(library)
        if (document := page.document(library)) is not None
    ]
    kinds = course.callout_names
    scripts = [script.code.text for script, _ in library.scripts.values()]
    renderer = library.renderer

    def draws() -> list[tuple[PageHead, Markup]]:
        listings._analyse.cache_clear()
        return [draw(inputs, document, renderer)[:2] for inputs, document in pages]

    def modules() -> list[frozenset[str]]:
        listings._analyse.cache_clear()
        return [find_imports(script) for script in scripts]

    def parses() -> list[object]:
        python_syntax._compile_error.cache_clear()
        return [parse_document(d.source, kinds, lesson=True) for d in documents]

    drafts = draws()
    documents = [document for _, document in pages]
    steps: dict[str, Callable[[], object]] = {
        "parse": parses,
        "its summary": lambda: [encode(without_prose(d)) for d in documents],
        "modules that scripts import": modules,
        "draw": draws,
        "settle, facts and links": lambda: [record(*d, course.base_url) for d in drafts],
    }
    seconds = time_candidates(steps, max(2, repeat), time.process_time)
    print(f"\nof each of {len(pages)} lessons and pages, one core")
    for name, values in seconds.items():
        low, middle = min(values) / len(pages), statistics.median(values) / len(pages)
        print(f"  {name:<44} {1e3 * low:9.3f} ms  median {1e3 * middle:9.3f}")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    project = Path(__file__).resolve().parents[1]
    parser.add_argument("--course", type=Path, default=project)
    parser.add_argument("--repeat", type=int, default=9)
    arguments = parser.parse_args()
    root = arguments.course.resolve()
    gc.set_threshold(1_000_000, 50, 50)  # as for a command
    print(f"{platform.platform()}, {len(os.sched_getaffinity(0))} cores, {cpu_name()}")
    names = ("markdown-it-py", "mujoco", "numpy")
    print(f"Python {platform.python_version()}, " + ", ".join(f"{n} {version(n)}" for n in names))
    measure_parsing(root, arguments.repeat)
    measure_typing(root, arguments.repeat)
    measure_scripts(root, arguments.repeat)
    course = load(root).value
    assert course is not None
    results = verify(course, Options(root, 1, Store(root))).results
    results = replace(results, formulas=typeset(course))
    measure_stages(course, results, root, arguments.repeat)
    measure_lessons(course, results, arguments.repeat)


if __name__ == "__main__":
    main()
