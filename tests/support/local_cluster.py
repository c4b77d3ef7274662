"""A Dask scheduler and its workers; as a program it is that cluster until its input ends."""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]


def install_plugin(folder: Path) -> str:
    """Install the plug-in for clusters into a folder, as pip does it; returns Python's path."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder)]
    subprocess.run([*pip, *offline, str(ROOT / "plugins/cluster")], check=True)
    return f"{folder}:{ROOT}"


@contextlib.contextmanager
def local_cluster(folder: Path, count: int, path: str) -> Iterator[str]:
    """The address of a scheduler with some workers, which import from `path`."""
    process = subprocess.Popen(
        [sys.executable, __file__, str(folder), str(count)],
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    with process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.stdin.close()


def main() -> None:
    from distributed import LocalCluster

    folder, count = sys.argv[1:]
    with LocalCluster(
        n_workers=int(count),
        threads_per_worker=1,
        memory_limit=0,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
        local_directory=folder,
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
