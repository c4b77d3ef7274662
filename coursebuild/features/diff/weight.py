"""Compares the weight of the pages of a site before and after a change.

Entry point: `weight_section(old, new)`.
"""

from __future__ import annotations

from pathlib import Path

from coursebuild.core.pages.html_tree import elements_with
from coursebuild.core.pages.urls import Place
from coursebuild.features.diff.report import section

_SHARE = 0.01
"""Pages that change by less are not listed."""
_WHOLE = "the whole site"


def weight_section(old: Path, new: Path) -> str:
    """Report how the weight of pages changed; `old` and `new` are folders of sites."""
    for folder in (old, new):
        if not (folder / "index.html").is_file():
            return f"### Page weight\n\nNot compared: there is no site in `{folder.name}`.\n"
    before, now = _weights(old), _weights(new)
    sizes = {name: (before.get(name, 0), now.get(name, 0)) for name in {**before, **now}}
    rows = []
    by_change = sorted(sizes.items(), key=lambda item: -abs(item[1][1] - item[1][0]))
    for name, (a, b) in sorted(by_change, key=lambda item: item[0] != _WHOLE):
        if abs(b - a) >= _SHARE * max(a, b) or (name == _WHOLE and a != b):
            change = f"{b / a - 1:+.1%}" if a and b else "new" if b else "removed"
            rows.append((name, f"{a / 1000:.1f} kB", f"{b / 1000:.1f} kB", change))
    return section(
        "Page weight",
        "A page with the styles, scripts and pictures that it names, as they lie on the disk; a"
        f" server sends less. Pages that change by less than {_SHARE:.0%} are not listed.",
        ("page", "before", "now", "change"),
        rows,
    )


def _weights(site: Path) -> dict[str, int]:
    """Return the bytes of each page with the files that its HTML loads, and of all files."""
    files = [path for path in site.rglob("*") if path.is_file()]
    sizes = {path.relative_to(site).as_posix(): path.stat().st_size for path in files}
    pages = {path: {path, *_find_assets(site, path)} for path in sizes if path.endswith(".html")}
    weights = {path: sum(sizes.get(name, 0) for name in names) for path, names in pages.items()}
    return {**weights, _WHOLE: sum(sizes.values())}


def _find_assets(site: Path, page: str) -> set[str]:
    html = (site / page).read_text(encoding="utf-8", errors="replace")
    addresses = {
        attributes.get("src") or attributes.get("href") or ""
        for name, attributes in elements_with(html, ("src", "href"))
        if name in ("script", "img") or attributes.get("rel") == "stylesheet"
    }
    targets = (Place(page).target(address)[0] for address in addresses)
    return {path for path in targets if path is not None}
