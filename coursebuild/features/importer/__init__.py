"""`coursebuild import FOLDER`: a course of another tool becomes one of coursebuild.

Each lesson is read as segments: prose, fences and cells of code. What differs between the dialects
is written as coursebuild reads it. The course is written to a new folder, and each script runs
once, which shows the keys that its fence needs. What has no counterpart is listed with its place,
and never dropped in silence. The folder itself is only read.
"""

from coursebuild.api import Command, Feature

FEATURE = Feature(
    name="importer",
    needs=("lab",),
    commands=(
        Command(
            name="import",
            summary="convert a course that was written for another tool",
            module="coursebuild.features.importer.commands.import_course",
        ),
    ),
)
