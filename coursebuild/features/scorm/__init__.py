"""SCORM 1.2: the site as a package for learning platforms."""

from coursebuild.core.features import Exporter, Feature
from coursebuild.features.scorm.package import package_files

SCORM = Exporter(
    name="scorm",
    summary="the course as SCORM 1.2",
    file="course-scorm.zip",
    mark="imsmanifest.xml",
    make=package_files,
)
FEATURE = Feature(name="scorm", exporters=(SCORM,))
