"""Two pages to look things up in: the terms of the course, and the symbols of its formulas."""

from coursebuild.core.features import Feature, PageKind
from coursebuild.features.glossary.glossary import glossary_values
from coursebuild.features.glossary.symbol_index import symbols_values

FEATURE = Feature(
    name="glossary",
    pages=(
        PageKind(
            name="glossary",
            values=glossary_values,
            exists=lambda library: bool(library.references.terms),
            order=20,
        ),
        PageKind(
            name="symbols",
            values=symbols_values,
            exists=lambda library: library.references.has_symbols,
            order=30,
        ),
    ),
)
