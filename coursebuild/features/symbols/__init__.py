"""The symbols of a course: what a document says of each, and a page of all.

1. `mathml` reads the symbols of a formula, as the eye reads them.
2. `uses` reads a document: its symbols, and what it declares of them.
3. `page` brings those of all lessons together.
"""

from coursebuild.core.features import Feature, PageKind
from coursebuild.features.symbols.page import symbols_values, used_symbols
from coursebuild.features.symbols.uses import document_symbols

FEATURE = Feature(
    name="symbols",
    summary=document_symbols,
    pages=(
        PageKind(
            name="symbols",
            values=symbols_values,
            exists=lambda library: any(used_symbols(library)),
            order=30,
        ),
    ),
)
