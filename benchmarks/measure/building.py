"""Builds: cold, with nothing changed, with one lesson edited; the peak memory of a cold one.

Entry point: `measure_builds`. Rounds go over all tools, so that a slow moment of the machine does
not fall on one of them. Each build is checked: pages that are missing, or an edit that is not in
its page, count as a failure of the tool.

Products of earlier builds are moved away, and removed only when all is measured: ext4 does not
reuse an inode in the first minutes, and skips each such one whenever it makes a file. A tool that
writes six files for a lesson would pay up to a quarter for the removal of the build before.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.courses import write_course
from benchmarks.measure.process import CommandError, peak_memory, time_command
from benchmarks.measure.tools import Places, Tool, environment, lesson_place

COLD_BUILD, UNCHANGED_BUILD, EDIT_BUILD, PEAK_MEMORY = (
    "cold build",
    "nothing changed",
    "one lesson edited",
    "memory",
)


@dataclass(slots=True)
class Site:
    """A course that one tool builds."""

    tool: Tool
    folder: Path
    names: list[str]
    """Of the lessons."""
    name: str
    """Of the lesson that is edited."""
    original: str
    """Its text."""
    places: Places
    edits: int = 0
    moved_count: int = 0
    """How many files and folders were moved away."""
    failure: str = ""
    """The part that failed, if any: then its figures are incomplete."""
    figures: dict[str, list[float]] = field(default_factory=dict)

    @property
    def source(self) -> Path:
        """The file of that lesson."""
        return self.folder / lesson_place(self.tool.source, self.name)

    def edit(self) -> str:
        """Add a sentence to the lesson, a new one each time; gives a word of it."""
        self.edits += 1
        word = f"revision{self.edits}x"
        self.source.write_text(f"{self.original}\nOne more sentence: {word}.\n", encoding="utf-8")
        return word

    def clear(self) -> None:
        """Move away the products that a cold build must not find."""
        self.earlier.mkdir(exist_ok=True)
        paths = [path for pattern in self.tool.products for path in self.folder.glob(pattern)]
        for path in paths:
            if path.name not in self.tool.spared:
                self.moved_count += 1
                path.rename(self.earlier / str(self.moved_count))

    @property
    def earlier(self) -> Path:
        """The folder of what was moved away, until all is measured."""
        return self.folder.with_name(f"{self.folder.name}-earlier")

    @property
    def command(self) -> list[str]:
        """The command for a build."""
        return self.tool.build_command(self.folder)

    def build(self) -> float:
        """Build; gives seconds."""
        return time_command(self.command, self.folder, environment(self.places))

    def page(self) -> str:
        """The built page of the lesson that is edited."""
        return self.page_of(self.name).read_text(encoding="utf-8")

    def page_of(self, name: str) -> Path:
        """The built page of a lesson."""
        return self.folder / lesson_place(self.tool.page, name)

    def note(self, quantity: str, figure: float) -> None:
        """Record a figure."""
        self.figures.setdefault(quantity, []).append(figure)


def remove(path: Path) -> None:
    """Remove a file or a folder that may be there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def make_site(tool: Tool, lessons: int, work: Path, places: Places) -> Site:
    """Write the tool's course."""
    folder = work / f"{tool.key}-{lessons}"
    remove(folder)
    remove(folder.with_name(f"{folder.name}-earlier"))
    names = write_course(folder, lessons, tool.flavor)
    if tool.flavor in ("eleventy", "vitepress"):
        assert places.node is not None
        (folder / "node_modules").symlink_to(places.node)
    name = names[lessons // 2]
    original = (folder / lesson_place(tool.source, name)).read_text(encoding="utf-8")
    return Site(tool, folder, names, name, original, places)


def measure_builds(
    tools: list[Tool],
    lessons: int,
    rounds: int,
    work: Path,
    places: Places,
    say: Callable[[str], None],
) -> list[Site]:
    """Measure all tools that build."""
    sites = [make_site(tool, lessons, work, places) for tool in tools if tool.build]
    for site in sites:
        say(f"{lessons} lessons, first build: {site.tool.title}")
        attempt(site, COLD_BUILD, first_build, say)
    for turn in range(rounds):
        for site in sites:
            say(f"{lessons} lessons, round {turn + 1} of {rounds}: {site.tool.title}")
            attempt(site, "builds", one_round, say)
    for site in sites:
        if not site.tool.only_incremental:
            attempt(site, PEAK_MEMORY, memory, say)
    for site in sites:
        remove(site.earlier)
    return sites


def attempt(
    site: Site, part: str, work: Callable[[Site], None], say: Callable[[str], None]
) -> None:
    """Do something with a site; one that fails is reported and left out afterwards."""
    if not site.failure:
        try:
            work(site)
        except CommandError as error:
            site.failure = part
            say(f"{site.tool.title} FAILED: {error}")


def first_build(site: Site) -> None:
    """Build once without measuring, and count the pages."""
    site.build()
    pages = sum(site.page_of(name).exists() for name in site.names)
    if pages != len(site.names):
        raise CommandError(f"{pages} pages of {len(site.names)} were built")


def memory(site: Site) -> None:
    """Record the peak memory of a cold build."""
    site.clear()
    site.note(PEAK_MEMORY, peak_memory(site.command, site.folder, environment(site.places)))


def one_round(site: Site) -> None:
    """A cold build, one with nothing changed, one with a lesson edited."""
    if not site.tool.only_incremental:
        site.clear()
        site.note(COLD_BUILD, site.build())
    site.note(UNCHANGED_BUILD, site.build())
    word = site.edit()
    seconds = site.build()
    if word not in site.page():
        raise CommandError("what was edited is not in the built page")
    site.note(EDIT_BUILD, seconds)
