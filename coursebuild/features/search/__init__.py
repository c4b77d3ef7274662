"""Search over the whole course: a page with a form, and the index that browsers load.

1. `sections` cuts a page into sections of text, code and formulas.
2. `words` makes terms of them, as `site/js/search/words.js` makes terms of what a reader types.
3. `page` packs the text for the reader's browser, and the terms for the index.
4. `index` sorts the terms of all pages into small files, of which a query loads a few.
"""

from coursebuild.core.features import Feature, PageKind, PagePart
from coursebuild.core.pages.library import Library
from coursebuild.features.search.index import search_files
from coursebuild.features.search.page import note_page


def _values(library: Library) -> dict[str, object]:
    return {"action": "index.html"}


FEATURE = Feature(
    name="search",
    pages=(PageKind(name="search", values=_values, order=10, indexed=False, form=True),),
    parts=(PagePart(mark="", bundled="search.js", late=True),),
    note=note_page,
    files=search_files,
)
