"""The site without a network, and the page about it, which is also shown for missing pages."""

from coursebuild.core.features import Feature, PageKind, PagePart
from coursebuild.features.offline.files import offline_files

FEATURE = Feature(
    name="offline",
    pages=(PageKind(name="offline", values=lambda library: {}, order=70, indexed=False),),
    files=offline_files,
    parts=(PagePart(mark="data-keep", bundled="offline.js", texts=("offline.live.",)),),
)
