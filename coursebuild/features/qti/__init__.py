"""IMS QTI 2.1: the quizzes as a package for question banks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from coursebuild.core.features import Exporter, Feature

if TYPE_CHECKING:
    from coursebuild.core.model.results import SiteFile
    from coursebuild.core.pages.context import ExportContext
    from coursebuild.core.text.diagnostics import Diagnostic


def export(context: ExportContext) -> Iterator[SiteFile | Diagnostic]:
    """Yield the files of the package."""
    from coursebuild.features.qti.items import package_files

    return package_files(context)


QTI = Exporter(
    name="qti",
    summary="its quizzes as IMS QTI 2.1",
    file="quizzes-qti.zip",
    mark="imsmanifest.xml",
    make=export,
)
FEATURE = Feature(name="qti", needs=("quiz",), exporters=(QTI,))
