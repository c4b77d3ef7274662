"""Everything that the pages of a built site hand over to run: each in an empty folder, counted.

    python benchmarks/handed_over.py public [--python PATH] [--jobs 2]

1. Each *Download* beside a listing: the file itself, or the archive, unpacked.
2. Each *Export as Python* of a lab, with the values with which its controls start.
3. Each archive of a lesson, and that of the whole course: its scripts, in their order.

The interpreter has the packages of the course and nothing of the course itself; without `--python`,
`uv run --offline` makes an environment for each file of what it declares, or for an archive of its
`requirements.txt`.
"""

from __future__ import annotations

import argparse
import html
import io
import json
import os
import re
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from coursebuild.core.run import gate

_PLACE = re.compile(r"\{\{control:(\d+)\}\}")
_DOWNLOAD = re.compile(r'<a href="([^"]+\.(?:py|zip))" download>')
_CONFIG = re.compile(r'data-config="([^"]+)"')
_REQUIREMENTS = "requirements.txt"
_SECONDS = 900


class HandedOver(NamedTuple):
    """Something to run."""

    kind: str
    name: str
    files: dict[str, bytes]
    entries: list[str]


def collect(site: Path) -> Iterator[HandedOver]:
    """What the pages of a site link to, each once."""
    visited: set[Path] = set()
    for page in sorted(site.rglob("*.html")):
        text = page.read_text("utf-8")
        for pattern in (_DOWNLOAD, _CONFIG):
            for match in pattern.finditer(text):
                address = unquote(html.unescape(match[1]))
                path = (page.parent / address).resolve()
                if path in visited or not path.is_file():
                    continue
                visited.add(path)
                yield from _read(path, is_lab=pattern is _CONFIG)


def _read(path: Path, *, is_lab: bool) -> Iterator[HandedOver]:
    data = path.read_bytes()
    if is_lab:
        config = json.loads(data)
        export = config.get("exportPython")
        if export:
            values = [control["value"] for control in config["controls"]]
            text = _PLACE.sub(lambda match: _literal(values[int(match[1])]), export["text"])
            yield HandedOver(
                "export", export["name"], {export["name"]: text.encode()}, [export["name"]]
            )
    elif path.suffix == ".py":
        yield HandedOver("download", path.name, {path.name: data}, [path.name])
    else:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        tops = {name.split("/")[0] for name in files}
        assert len(tops) == 1, f"{path} has more than one folder"
        top = tops.pop() + "/"
        files = {name.removeprefix(top): content for name, content in files.items()}
        scripts = [name for name in sorted(files) if re.fullmatch(r"examples/[^/]+\.py", name)]
        kind = "archive" if "README.md" in files else "download"
        yield HandedOver(kind, path.name, files, scripts)


def _literal(value: float | str) -> str:
    """A value as the page writes it."""
    is_whole = isinstance(value, float) and value.is_integer()
    return json.dumps(int(value) if is_whole else value)


def run(thing: HandedOver, python: str | None) -> list[tuple[str, str]]:
    """What of it fails, each with the last line that it wrote."""
    failures = []
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    environment.pop("PYTHONPATH", None)
    packages = ["--with-requirements", _REQUIREMENTS] if _REQUIREMENTS in thing.files else []
    runner = ["uv", "run", "--offline", *packages] if python is None else [python]
    with tempfile.TemporaryDirectory() as folder:
        for path, data in thing.files.items():
            place = Path(folder, path)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        for entry in thing.entries:
            try:
                done = gate.finish([*runner, entry], environment, folder=folder, seconds=_SECONDS)
            except TimeoutError as error:
                failures.append((entry, str(error)))
                continue
            if done.status:
                failures.append((entry, done.last_line() or f"status {done.status}"))
    return failures


def main() -> None:
    """Run everything, and print how much of it fails."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("site", type=Path)
    parser.add_argument("--python", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--without", nargs="*", default=[], help="kinds to leave out")
    arguments = parser.parse_args()
    # A file is run in a folder of its own, where a path from here leads nowhere.
    python = arguments.python and str(arguments.python.absolute())
    things = [t for t in collect(arguments.site) if t.kind not in arguments.without]
    total, failure_counts = Counter[str](), Counter[str]()
    with ThreadPoolExecutor(arguments.jobs) as threads:
        results = threads.map(lambda thing: run(thing, python), things)
        for thing, failures in zip(things, results, strict=True):
            total[thing.kind] += 1
            failure_counts[thing.kind] += bool(failures)
            for entry, line in failures:
                print(f"{thing.name}: {entry}: {line}")
    for kind in total:
        print(f"{kind}: {failure_counts[kind]} of {total[kind]} fail")
    sys.exit(any(failure_counts.values()))


if __name__ == "__main__":
    main()
