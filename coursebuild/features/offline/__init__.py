"""The page about what is kept in the browser, which is also shown where a page is not."""

from coursebuild.core.features import Feature, PageKind, PagePart

FEATURE = Feature(
    name="offline",
    pages=(PageKind(name="offline", values=lambda library: {}, order=70, indexed=False),),
    parts=(PagePart(mark="data-keep", bundled="offline.js", texts=("offline.live.",)),),
)
