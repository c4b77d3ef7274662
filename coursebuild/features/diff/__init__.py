"""The command `diff`, which reports what a change does to a course, for its reviewers.

Two states of a course, and their sites, are read from the disk, or the earlier one from git.
Nothing is run.
"""

from coursebuild.core.features import Command, Feature

FEATURE = Feature(
    name="diff",
    needs=("truth",),
    commands=(
        Command(
            name="diff",
            summary="show what a change does to outputs, figures, labs, truth and page weight",
            module=f"{__name__}.commands",
        ),
    ),
)
