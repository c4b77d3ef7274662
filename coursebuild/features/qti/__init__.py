"""IMS QTI 2.1: the quizzes as a package for question banks."""

from coursebuild.core.features import Exporter, Feature
from coursebuild.features.qti.items import package_files

QTI = Exporter(
    name="qti",
    summary="its quizzes as IMS QTI 2.1",
    file="quizzes-qti.zip",
    mark="imsmanifest.xml",
    make=package_files,
)
FEATURE = Feature(name="qti", needs=("quiz",), exporters=(QTI,))
