"""A further lesson takes little more memory than its text."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

import pytest

from coursebuild.core.model.results import CachedFile
from coursebuild.pipeline.publication import build, make_files
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site
from support.scratch_course import Folder, block

pytestmark = pytest.mark.slow

FEW_LESSONS, MANY_LESSONS = 20, 50
TEXT = 20_000
"""Bytes of prose in a lesson."""
SLOPE = 60_000
"""Bytes that a further lesson may take: its text, its summary, names and keys of its files, and its
packed tree."""


def write_course(folder: Folder, count: int, size: int = TEXT) -> None:
    """Write a course of some lessons, each with as much prose.

    A level has ten lessons, since each of its pages lists them all.
    """
    ids = [f"{1 + n // 10}.{1 + n % 10}" for n in range(count)]
    entries = ['[course]\ntitle = "Long"\n']
    for n, (id_, following) in enumerate(zip(ids, ids[1:] + ids[:1], strict=True)):
        prose = "What is said of *this* thing is said of `that` one. " * 6 + "\n\n"
        code = "\n".join(f"print({i})" for i in range(120))
        text = block(f"s{n}.py", code, info="norun") + prose * (size // len(prose))
        links = f"See [there](#part), and [the next](lesson:{following}).\n"
        folder.write(f"content/lessons/{id_}-l.md", f"## Part {{#part}}\n\n{text}{links}")
        if n % 10 == 0:
            level = id_.split(".")[0]
            entries.append(f'[[level]]\nid = "{level}"\ntitle = "Level {level}"\n')
        entries.append(
            f'[[level.lesson]]\nid = "{id_}"\nslug = "l"\ntitle = "L {n}"\nstatus = "complete"\n'
        )
    folder.write("content/course.toml", "\n".join(entries))


def peak(folder: Folder) -> int:
    """The peak of Python's memory during a build, with the files that it makes, in bytes."""
    gc.collect()
    gc.freeze()  # else the garbage of other tests decides when the collector runs
    tracemalloc.start()
    try:
        options = folder.options()
        with Reader(options) as reader:
            report, site = make_files(options, reader, lambda lib: Site(lib, reader, options))
            assert site is not None, report.diagnostics
            for file in site.files:
                if file.path.endswith((".html", ".md", ".ipynb", ".epub")):
                    assert isinstance(file, CachedFile)
                    file.make()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        gc.unfreeze()


@pytest.mark.parametrize("again", [False, True], ids=["cold", "one edit"])
def test_memory_does_not_grow_with_the_lessons(tmp_path: Path, stores: Path, again: bool) -> None:
    peaks: dict[int, list[int]] = {FEW_LESSONS: [], MANY_LESSONS: []}
    # Several times: whatever else the process does can only add to it.
    for number, count in enumerate((FEW_LESSONS, FEW_LESSONS, MANY_LESSONS, MANY_LESSONS)):
        folder = Folder(tmp_path / str(number))
        write_course(folder, count)
        folder.borrow(stores)
        if again:
            build(folder.options(), Path("public"))
            folder.replace("content/lessons/1.2-l.md", "See [there]", "See again [there]")
        peaks[count].append(peak(folder))
    slope = (min(peaks[MANY_LESSONS]) - min(peaks[FEW_LESSONS])) / (MANY_LESSONS - FEW_LESSONS)
    assert slope < SLOPE, f"{slope:.0f} bytes a lesson: {peaks}"
