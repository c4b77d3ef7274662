"""Search over the whole course: a page with a form, and the index that browsers load.

1. `page` splits a page into sections of text, code and formulas, and packs the text for the
   reader's browser, and the terms for the index.
2. `words` makes these terms, by the rules that `site/js/search/words.js` has for queries.
3. `index` sorts the terms of all pages into small files; a query loads a few of them.
"""

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
