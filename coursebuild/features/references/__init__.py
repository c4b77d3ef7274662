"""Sources: `content/references.bib`, cited by `[@euler1758, p. 12]`, with a page that lists all.

The packages that read and format are an extra, `coursebuild[references]`, and are imported where a
course has a list of sources.
"""

from coursebuild.core.features import Feature, PageKind
from coursebuild.core.text.rules import Rule
from coursebuild.features.references import citing

FEATURE = Feature(
    name="references",
    citations=citing.document_citations,
    check=citing.check_sources,
    pages=(
        PageKind(
            name="references",
            values=citing.references_values,
            exists=lambda library: bool(citing.references_values(library)["entries"]),
            order=25,
        ),
    ),
    rules=(
        Rule("source-unknown", "error", "A text cites a source that is not in the list."),
        Rule(
            "source-malformed",
            "error",
            "An entry of the list of sources cannot be read.",
            "only you know what was meant",
        ),
        Rule(
            "source-style",
            "error",
            "The course's style for citations cannot be used.",
            "a file has to be added, moved or replaced",
        ),
        Rule(
            "source-unused",
            "warning",
            "No text cites this source.",
            "only you know what was meant",
        ),
        Rule(
            "source-identifier",
            "warning",
            "A source has no valid DOI or ISBN.",
            "the number is in the work, or in a catalogue",
        ),
    ),
)
