"""Measure coursebuild and its peers in one run.

Run: python benchmarks/builds.py [--peers BIN] [--node NODE_MODULES] [--sizes 80,800] [--docs]

1. The same course is written for each peer that is installed (`benchmarks/README.md` says how they
   are), at each size.
2. In rounds over all of them: a cold build, one with nothing changed, one with a lesson edited.
   Then the memory of a cold build, and from a save to the page in the live preview.
3. In rounds: the scripts of a course of MuJoCo scripts, run in all ways.
4. The tables are printed; --json and --docs keep them.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.measure.building import make_site, measure_builds  # noqa: E402
from benchmarks.measure.process import CommandError  # noqa: E402
from benchmarks.measure.report import BASE, describe, markdown, put_into  # noqa: E402
from benchmarks.measure.running import jcache_version, measure_scripts  # noqa: E402
from benchmarks.measure.serving import measure_serving  # noqa: E402
from benchmarks.measure.tools import Places, all_tools  # noqa: E402

DOCS = ROOT / "docs/explanation/benchmarks.md"
PARTS = ("builds", "serve", "scripts")


def arguments_of() -> argparse.Namespace:
    """Parse the arguments."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--peers", type=Path, help="`bin` of an environment with peers.txt")
    parser.add_argument("--node", type=Path, help="`node_modules` with package.json's packages")
    parser.add_argument("--sizes", default="80,800", help="numbers of lessons")
    parser.add_argument("--rounds", default="7,3", help="rounds at each size")
    parser.add_argument("--scripts", type=int, default=20, help="number of MuJoCo scripts")
    parser.add_argument("--parts", default=",".join(PARTS), help=f"of {', '.join(PARTS)}")
    parser.add_argument("--tools", default="", help="keys of the tools; default: all there are")
    parser.add_argument("--work", type=Path, help="a folder for the courses; default: a new one")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    parser.add_argument("--docs", action="store_true", help=f"put the tables into {DOCS.name}")
    arguments = parser.parse_args()
    for part in arguments.parts.split(","):
        if part not in PARTS:
            parser.error(f"there is no part `{part}`: name some of {', '.join(PARTS)}")
    return arguments


def say(text: str) -> None:
    """Report the progress."""
    print(text, file=sys.stderr, flush=True)


def main() -> None:
    """Measure, print, save."""
    arguments = arguments_of()
    peers = arguments.peers.resolve() if arguments.peers else None
    node = arguments.node.resolve() if arguments.node else None
    work = arguments.work.resolve() if arguments.work else Path(tempfile.mkdtemp(prefix="bench-"))
    work.mkdir(parents=True, exist_ok=True)
    try:
        text = measure(arguments, Places(peers, node), work)
    except CommandError as error:
        sys.exit(str(error))
    finally:
        if arguments.work is None:
            shutil.rmtree(work, ignore_errors=True)
    print(text)
    if arguments.docs:
        put_into(DOCS, text)


def measure(arguments: argparse.Namespace, places: Places, work: Path) -> str:
    """Measure everything that the arguments ask for; gives the tables as text."""
    all_known_tools = all_tools(places)
    keys = {tool.key for tool in all_known_tools}
    selection = set(arguments.tools.split(",")) if arguments.tools else keys
    if selection - keys:
        unknown, names = ", ".join(sorted(selection - keys)), ", ".join(sorted(keys))
        raise CommandError(f"no tool is called {unknown}: there are {names}")
    tools = [tool for tool in all_known_tools if tool.key in selection]
    report = describe(tools, jcache_version(places))
    if any(tool.key == BASE and tool.version is None for tool in tools):
        raise CommandError(f"{sys.executable} cannot run coursebuild")
    installed = [tool for tool in tools if tool.version is not None]
    parts = arguments.parts.split(",")
    sizes = [int(size) for size in arguments.sizes.split(",")]
    rounds = [int(number) for number in arguments.rounds.split(",")]
    for i, size in enumerate(sizes):
        turns = rounds[min(i, len(rounds) - 1)]
        sites = []
        if "builds" in parts:
            sites = measure_builds(installed, size, turns, work, places, say)
            report.add_sites(sites, size)
            keep(arguments, report.as_json())
        if "serve" in parts:
            built_keys = {site.tool.key for site in sites}
            unbuilt = [t for t in installed if t.serve_command and t.key not in built_keys]
            sites += [make_site(tool, size, work, places) for tool in unbuilt]
            measure_serving(sites, min(turns, 2), 5, say)
        report.add_sites(sites, size)
        keep(arguments, report.as_json())
    if "scripts" in parts:
        try:
            report.add_scripts(measure_scripts(arguments.scripts, rounds[0], work, places, say))
        except CommandError as error:  # the tables of the other parts are still worth printing
            say(f"scripts are not measured: {error}")
    keep(arguments, report.as_json())
    return markdown(report)


def keep(arguments: argparse.Namespace, figures: dict[str, object]) -> None:
    """Write the figures so far, so that an interrupted run is not lost."""
    if arguments.json is not None:
        text = json.dumps(figures, indent=1, ensure_ascii=False)
        arguments.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
