"""The terms of a course: how documents define each, and a page that lists all."""

from coursebuild.core.features import Feature, PageKind
from coursebuild.features.glossary.terms import document_terms, glossary_values

FEATURE = Feature(
    name="glossary",
    summary=document_terms,
    pages=(
        PageKind(
            name="glossary",
            values=glossary_values,
            exists=lambda library: any(library.summaries("glossary")),
            order=20,
        ),
    ),
)
