"""The search: its page, its script, and the index of a course."""

from coursebuild.api import Feature, PageKind, PagePart, on_demand

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
    note=on_demand("coursebuild.features.search.page:note_page"),
    files=on_demand("coursebuild.features.search.index_files:search_files"),
)
