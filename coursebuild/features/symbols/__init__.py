"""The symbols of a course: what documents declare of each, and a page that lists all."""

from coursebuild.core.features import Feature, PageKind
from coursebuild.features.symbols.uses import document_symbols, symbols_values, used_symbols

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
