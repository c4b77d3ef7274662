"""Values into HTML and the files of the site, pure.

`render_site(course, results, assets, options)` gives the files; `check_links(files, base_url)` says
what is broken in them.

What is named here is imported when it is first asked for: most of it is needed only where something
is drawn.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coursebuild.core.pages.assets import Assets
    from coursebuild.core.pages.fonts import FontJob, subset_font
    from coursebuild.core.pages.links import BrokenLink, check_links
    from coursebuild.core.pages.site import SiteOptions, render_site
    from coursebuild.core.pages.zips import Package, Surroundings, imported_modules

__all__ = [
    "Assets",
    "BrokenLink",
    "FontJob",
    "Package",
    "SiteOptions",
    "Surroundings",
    "check_links",
    "imported_modules",
    "render_site",
    "subset_font",
]

_MODULES = {
    "Assets": "assets",
    "BrokenLink": "links",
    "FontJob": "fonts",
    "Package": "zips",
    "SiteOptions": "site",
    "Surroundings": "zips",
    "check_links": "links",
    "imported_modules": "zips",
    "render_site": "site",
    "subset_font": "fonts",
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
