"""The page of the hard cases: measurements of MuJoCo beside theory.

The page exists where hard cases are recorded.
"""

from coursebuild.core.features import Command, Feature, PageKind
from coursebuild.features.numerics.page import numerics_values

FEATURE = Feature(
    name="numerics",
    needs=("bench",),
    pages=(
        PageKind(
            name="numerics",
            values=numerics_values,
            exists=lambda library: bool(library.reports.cases),
            order=40,
        ),
    ),
    commands=(
        Command(
            name="stability",
            summary="measure MuJoCo on hard cases and compare with theory",
            module="coursebuild.features.numerics.commands",
        ),
    ),
)
