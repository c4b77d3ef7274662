"""Values into HTML and the files of the site, pure.

`render_site(course, results, assets, options)` gives the files; `check_links(files, base_url)` says
what is broken in them.
"""

from coursebuild.render.assets import Assets
from coursebuild.render.fonts import FontJob, subset_font
from coursebuild.render.links import BrokenLink, check_links
from coursebuild.render.site import SiteOptions, render_site
from coursebuild.render.zips import Package, Surroundings, imported_modules

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
