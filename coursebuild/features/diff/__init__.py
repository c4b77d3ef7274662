"""The command `diff`, which reports what a change does to a course, for its reviewers.

`report` compares two states of a course, `weight` their sites; `commands` reads them from the disk,
or an earlier state from git. Nothing is run.
"""

from coursebuild.core.features import Command, Feature

FEATURE = Feature(
    name="diff",
    needs=("truth",),
    commands=(
        Command(
            name="diff",
            summary="say what a change does to outputs, figures, labs, truth and page weight",
            module=f"{__name__}.commands",
        ),
    ),
)
