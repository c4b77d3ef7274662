"""The terms of a course: what a document says of each, and a page of all.

1. `terms` reads a document: each term with two sentences of its paragraph (`sentences`).
2. `page` brings those of all documents together.
"""

from coursebuild.core.features import Feature, PageKind
from coursebuild.features.glossary.page import glossary_values
from coursebuild.features.glossary.terms import document_terms

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
