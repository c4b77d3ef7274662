"""IMS QTI 2.1: the quizzes as a package for question banks."""

from collections.abc import Iterator

from coursebuild.api import Diagnostic, ExportContext, Exporter, Feature, SiteFile


def export(context: ExportContext) -> Iterator[SiteFile | Diagnostic]:
    """Yield the files of the package; this needs the feature `quiz`, which may not be there."""
    from coursebuild.features.qti.items import package_files

    return package_files(context)


QTI = Exporter(
    name="qti",
    summary="its quizzes as IMS QTI 2.1",
    file="quizzes-qti.zip",
    mark="imsmanifest.xml",
    make=export,
)
FEATURE = Feature(name="qti", needs=("quiz", "exercise"), exporters=(QTI,))
