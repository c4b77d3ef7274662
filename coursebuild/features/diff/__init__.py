"""The command `diff` compares two states of a course and their sites; nothing is run."""

from coursebuild.api import Command, Feature

FEATURE = Feature(
    name="diff",
    needs=("truth",),
    commands=(
        Command(
            name="diff",
            summary="show what a change does to outputs, figures, labs, results and page weight",
            module=f"{__name__}.commands",
        ),
    ),
)
