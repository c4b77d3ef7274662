"""IMS QTI 2.1: the quizzes as a package for question banks."""

from coursebuild.api import Exporter, Feature, on_demand

QTI = Exporter(
    name="qti",
    summary="its quizzes as IMS QTI 2.1",
    file="quizzes-qti.zip",
    mark="imsmanifest.xml",
    make=on_demand("coursebuild.features.qti.items:package_files"),
)
FEATURE = Feature(name="qti", needs=("quiz", "exercise"), exporters=(QTI,))
