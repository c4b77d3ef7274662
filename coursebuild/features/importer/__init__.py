"""`coursebuild import FOLDER`: a course of another tool becomes one of coursebuild.

1. The files of the folder are listed, and read in one way alone (`source_files`). Its map says
   which lessons there are: a `course.json` (`course_map`), the table of contents of Jupyter Book,
   MyST, Quarto or MkDocs, or the files themselves (`convert`).
2. Each lesson is read as segments: prose, fences and cells of code (`segments`).
3. What differs between the dialects is written as coursebuild reads it (`prose`, `blocks`),
   and the lessons are put together (`convert`).
4. The course is written to a new folder, each script runs once, and says by that which keys its
   fence needs (`commands`). Then all of it is checked. What an import that was killed had written
   is taken back to how it was converted, and all is done again from there.

What has no counterpart is listed with its place, and never dropped in silence. The folder itself is
only read.
"""

from coursebuild.core.features import Command, Feature

FEATURE = Feature(
    name="importer",
    commands=(
        Command(
            name="import",
            summary="convert a course that was written for another tool",
            module="coursebuild.features.importer.commands",
        ),
    ),
)
