"""SCORM 1.2: the site as a package for learning platforms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from coursebuild.core.features import Exporter, Feature

if TYPE_CHECKING:
    from coursebuild.core.model.results import SiteFile
    from coursebuild.core.pages.added_files import ExportContext


def export(context: ExportContext) -> Iterator[SiteFile]:
    """The files of the package."""
    from coursebuild.features.scorm.package import package_files

    return package_files(context)


SCORM = Exporter(
    name="scorm",
    summary="the course as SCORM 1.2",
    file="course-scorm.zip",
    mark="imsmanifest.xml",
    make=export,
)
FEATURE = Feature(name="scorm", exporters=(SCORM,))
