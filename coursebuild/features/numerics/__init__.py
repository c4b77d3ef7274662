"""The pages of the hard cases, and the command that measures them."""

from coursebuild.api import Command, Feature, PageKind, on_demand

KIND = PageKind(
    name="numerics",
    values=on_demand("coursebuild.features.numerics.case_pages:numerics_values"),
    exists=lambda library: bool(library.reports.cases),
    parts=on_demand("coursebuild.features.numerics.case_pages:case_families"),
    part_values=on_demand("coursebuild.features.numerics.case_pages:family_values"),
    order=40,
)

FEATURE = Feature(
    name="numerics",
    needs=("bench",),
    pages=(KIND,),
    commands=(
        Command(
            name="stability",
            summary="measure MuJoCo on hard cases and compare with theory",
            module="coursebuild.features.numerics.commands",
        ),
    ),
)
