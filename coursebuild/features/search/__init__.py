"""Search over the whole course: a page with a form, and the index that browsers load."""

from coursebuild.core.features import Feature, PageKind, PagePart
from coursebuild.features.search.index import search_files
from coursebuild.features.search.page import note_page

_PAGE = PageKind(
    name="search",
    values=lambda library: {"action": "index.html"},
    order=10,
    indexed=False,
    form=True,
)
FEATURE = Feature(
    name="search",
    pages=(_PAGE,),
    parts=(PagePart(mark="", bundled="search.js", late=True),),
    note=note_page,
    files=search_files,
)
