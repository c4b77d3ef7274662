"""The page of the search: a form, which the page's script brings to life."""

from coursebuild.core.features import Feature, PageKind
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library


def _values(library: Library) -> dict[str, object]:
    return {"action": urls.Place(urls.SEARCH).href(urls.SEARCH)}


FEATURE = Feature(
    name="search",
    pages=(PageKind(name="search", values=_values, order=10, indexed=False, form=True),),
)
