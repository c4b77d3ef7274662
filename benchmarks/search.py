"""The search of a long course: what a query fetches and takes, and what the index costs a build.

Run: python benchmarks/search.py [--lessons N] [--pagefind FILE] [--rounds N] [--json FILE]

1. A course of lessons of 15 kB with a real course's number of different words is built with the
   search and without it, and a sentence is added to one lesson: processor time of both, in turns.
2. In headless Chromium an address with a query is opened in a fresh profile: requests and bytes of
   the search as sent and unpacked, time until the first result stands on the page, memory of the
   page, and its longest task. Then further queries, one after the other.
3. Words of the course are misspelt, and it is counted for how many of them the first results are
   those of the word itself.
4. The same of Pagefind, where its program is given: its own indexer on the same pages, its own
   loader in a page of a few lines. It has no search from a disk and none for misspelt words, so
   that what cannot be compared is left out.

Bytes are those of a server that compresses as servers do: copies that lie beside the files, and
everything else with Brotli's fifth quality.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import json
import random
import resource
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from playwright.sync_api import sync_playwright  # noqa: E402

from benchmarks.generate.wordy import vocabulary, write_wordy  # noqa: E402
from coursebuild.core.run import gate  # noqa: E402
from support.chromium import Browsers  # noqa: E402

QUERIES = ("inertia tensor", "gyroscope", "energy drift", "model", "quaternion rotation")
WITHOUT_SEARCH = """
from coursebuild.core.features import Feature
import coursebuild.features.search as search
search.FEATURE = Feature(name="search")
"""
COMMAND = "import sys\n{patch}\nfrom coursebuild.cli import main\nsys.exit(main(sys.argv[1:]))"
PEER_PAGE = """<!DOCTYPE html><html lang="en"><title>x</title><ol></ol>
<script type="module" src="peer.js"></script></html>"""
PEER_SCRIPT = """
const pagefind = await import('./pagefind/pagefind.js')
async function find(query, most) {
  const { results } = await pagefind.search(query)
  const pages = await Promise.all(results.slice(0, most).map((result) => result.data()))
  return { count: results.length, pages }
}
globalThis.find = find
const { pages } = await find(new URLSearchParams(location.search).get('q'), 15)
for (const page of pages) {
  const item = document.createElement('li')
  item.innerHTML = page.excerpt
  item.dataset.path = page.url
  document.querySelector('ol').append(item)
}
"""


# --- building


def build_course(folder: Path, patch: str = "") -> float:
    """Build a course; gives the processor time of it and its children, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", COMMAND.format(patch=patch), "-C", str(folder)]
    environment = gate.environment(*gate.TOOL, PYTHONPATH=str(ROOT))
    build = gate.finish([*command, "build", "--quiet"], environment, bound=False)
    if build.status:
        sys.exit(build.errors.decode())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_builds(work: Path, lessons: int, rounds: int) -> dict[str, Any]:
    """Processor time of builds with the search and without."""
    ways = {"with": "", "without": WITHOUT_SEARCH}
    cold: dict[str, float] = {}
    for way, patch in ways.items():
        write_wordy(work / way, lessons)
        cold[way] = build_course(work / way, patch)
    edits: dict[str, list[float]] = {way: [] for way in ways}
    lesson = "content/lessons/1.2-l1.md"
    for number in range(rounds + 1):
        for way, patch in ways.items():
            with (work / way / lesson).open("a", encoding="utf-8") as file:
                file.write(f"\nA sentence with word{number}.\n")
            took = build_course(work / way, patch)
            if number:  # the first is to be warm
                edits[way].append(took)
    medians = {way: statistics.median(seconds) for way, seconds in edits.items()}
    differences = [a - b for a, b in zip(edits["with"], edits["without"], strict=True)]
    return {
        "cold_s": cold["with"],
        "cold_added_ms_per_lesson": 1e3 * (cold["with"] - cold["without"]) / lessons,
        "cold_ratio": cold["with"] / cold["without"],
        "edit_s": medians["with"],
        "edit_added_ms": 1e3 * statistics.median(differences),
        "edit_ratio": medians["with"] / medians["without"],
    }


# --- asking


class Server(http.server.SimpleHTTPRequestHandler):
    """Sends files compressed, and notes what it has sent."""

    sent: list[tuple[str, int, int]]
    """Path, bytes sent, bytes unpacked."""

    def do_GET(self) -> None:
        import brotli

        path = self.path.partition("?")[0]
        file = Path(self.directory) / path.lstrip("/")
        if file.is_dir():
            file /= "index.html"
        if not file.is_file():
            self.send_error(404)
            return
        data = file.read_bytes()
        copy = file.with_name(file.name + ".br")
        packed = copy.read_bytes() if copy.is_file() else brotli.compress(data, quality=5)
        # What is compressed already, as Pagefind's files are, is sent as it is.
        is_compressed = len(packed) < len(data)
        body = packed if is_compressed else data
        self.sent.append((path, len(body), len(data)))
        self.send_response(200)
        self.send_header("Content-Type", self.guess_type(str(file)))
        self.send_header("Content-Length", str(len(body)))
        if is_compressed:
            self.send_header("Content-Encoding", "br")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        pass


@contextmanager
def serve(folder: Path) -> Iterator[tuple[str, list[tuple[str, int, int]]]]:
    """The address of a folder, and the list of what was sent."""
    sent: list[tuple[str, int, int]] = []
    kind = type("Handler", (Server,), {"sent": sent})
    handler = functools.partial(kind, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://localhost:{server.server_address[1]}/", sent
        server.shutdown()
        thread.join()


WATCH = """
globalThis.tasks = []
new PerformanceObserver((list) => tasks.push(...list.getEntries().map((e) => e.duration)))
  .observe({ type: 'longtask', buffered: true })
"""
FIRST = """async (item) => {
  for (;;) {
    if (document.querySelector(item)) return performance.now()
    await new Promise((go) => setTimeout(go, 2))
  }
}"""


def measure_queries(
    browser: Any,
    address: str,
    sent: list[tuple[str, int, int]],
    index_path: str,
    item: str,
    rounds: int,
) -> dict[str, Any]:
    """The requests, bytes, time and memory of first queries, each in a fresh profile."""
    figures: dict[str, list[float]] = {}
    for query in QUERIES * rounds:
        context = browser.new_context(service_workers="block")
        page = context.new_page()
        page.add_init_script(WATCH)
        sent.clear()
        page.goto(address + query.replace(" ", "%20"), wait_until="commit")
        elapsed = page.evaluate(FIRST, item)
        page.wait_for_timeout(300)
        fetched = [e for e in sent if index_path in e[0] and not e[0].endswith(".html")]
        tools = context.new_cdp_session(page)
        tools.send("HeapProfiler.collectGarbage")
        heap = tools.send("Runtime.getHeapUsage")["usedSize"]
        row = {
            "first_result_ms": elapsed,
            "requests": len(fetched),
            "sent_kB": sum(entry[1] for entry in fetched) / 1e3,
            "unpacked_kB": sum(entry[2] for entry in fetched) / 1e3,
            "heap_MB": heap / 1e6,
            "longest_task_ms": max([0.0, *page.evaluate("() => tasks")]),
        }
        for key, value in row.items():
            figures.setdefault(key, []).append(value)
        context.close()
    return {key: statistics.median(values) for key, values in figures.items()}


def misspell(word: str, chance: random.Random) -> str:
    """The word with two neighbours swapped, or a letter left out, put in, or replaced."""
    at = chance.randrange(1, len(word) - 1)
    letter = chance.choice("aeinrst")
    return chance.choice(
        (
            word[:at] + word[at + 1] + word[at] + word[at + 2 :],
            word[:at] + word[at + 1 :],
            word[:at] + letter + word[at:],
            word[:at] + letter + word[at + 1 :],
        )
    )


def share_of_misspellings_found(page: Any, ask: str, count: int = 40) -> float:
    """The share of misspelt words whose first result is among the first three of the right word.

    `ask` is a function of the page that gives the results of a query.
    """
    chance = random.Random(5)
    words = [word for word in vocabulary()[300:8000] if len(word) >= 6]
    right = 0
    for word in chance.sample(words, count):
        misspelling = misspell(word, chance)
        expected, results = (page.evaluate(ask, query) for query in (word, misspelling))
        right += bool(set(expected[:3]) & set(results[:1]))
    return right / count


TYPE = """async (query) => {
  const field = document.querySelector('#_q')
  const list = document.querySelector('.found-pages')
  field.value = query
  const status = document.querySelector('.search-results .search-status')
  list.replaceChildren()
  status.textContent = ''
  document.querySelector('[data-search-form]').requestSubmit()
  while (status.textContent === '') await new Promise((go) => setTimeout(go, 2))
  return [...list.querySelectorAll('h2 a')].map((a) => new URL(a.href).pathname)
}"""
PEER_ASK = """async (query) => (await find(query, 3)).pages.map((p) => p.url)"""


def measure_searches(work: Path, pagefind: Path | None, rounds: int) -> dict[str, Any]:
    """Measure the searches of coursebuild and Pagefind in the same browser."""
    site, result = work / "with" / "public", {}
    searches = {"coursebuild": (site, "search/index.html", "search", ".found-pages > li", TYPE)}
    if pagefind is not None:
        result["pagefind_indexing"] = peer_index(site, work / "peer", pagefind)
        searches["pagefind"] = (work / "peer", "peer.html", "/pagefind/", "li", PEER_ASK)
    with sync_playwright() as playwright:
        browser = Browsers(playwright)["plain"]
        for name, (folder, path, index_path, item, ask) in searches.items():
            with serve(folder) as (base, sent):
                address = f"{base}{path}?q="
                row = measure_queries(browser, address, sent, index_path, item, rounds)
                page = browser.new_context(service_workers="block").new_page()
                page.goto(address + "model", wait_until="networkidle")
                row["misspelt_found"] = share_of_misspellings_found(page, ask)
                result[name] = row
    return result


def peer_index(site: Path, folder: Path, program: Path) -> dict[str, float]:
    """Let Pagefind index the lessons; gives the cost of the first time and of a second."""
    shutil.copytree(site / "lessons", folder / "lessons")
    (folder / "peer.html").write_text(PEER_PAGE, encoding="utf-8")
    (folder / "peer.js").write_text(PEER_SCRIPT, encoding="utf-8")
    command = [str(program), "--site", str(folder), "--root-selector", "main", "--glob"]
    runs = []
    for _ in range(2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        start = time.perf_counter()
        if gate.finish([*command, "lessons/*.html"], gate.environment(), bound=False).status:
            sys.exit("the peer fails")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        runs.append((cpu, time.perf_counter() - start))
    files = [path for path in (folder / "pagefind").rglob("*") if path.is_file()]
    return {
        "cpu_s": runs[0][0],
        "again_cpu_s": runs[1][0],
        "memory_MB": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e3,
        "files": len(files),
        "MB": sum(path.stat().st_size for path in files) / 1e6,
    }


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lessons", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pagefind", type=Path, help="its program, of version 1.6.0")
    parser.add_argument("--site", type=Path, help="a folder with a course `with/`, built before")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    report: dict[str, Any] = {"lessons": arguments.lessons}
    with tempfile.TemporaryDirectory() as scratch:
        work = arguments.site or Path(scratch)
        if arguments.site is None:
            report["building"] = measure_builds(work, arguments.lessons, arguments.rounds)
        index = work / "with" / "public"
        files = [*(index / "assets" / "search").iterdir(), *(index / "search").iterdir()]
        plain = [path for path in files if path.suffix == ".js"]
        report["files"] = len(files)
        report["MB"] = sum(path.stat().st_size for path in plain) / 1e6
        report |= measure_searches(work, arguments.pagefind, arguments.rounds)
    text = json.dumps(report, indent=1)
    print(text)
    if arguments.json:
        arguments.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
