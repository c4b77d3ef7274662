"""Sources: `content/references.bib`, cited by `[@euler1758, p. 12]`, with a page that lists all.

1. `bibtex` reads the list, `csl` formats what is cited by a style of the Citation Style Language.
2. `citing` gives each page its citations and the references below its text, checks both, and lists
   all references of the course with the lessons that cite them.

The packages that read and format are an extra, `coursebuild[references]`, and are imported where a
course has a list of sources.
"""

from coursebuild.core.features import Feature, PageKind
from coursebuild.core.text.rules import Rule
from coursebuild.features.references.citing import (
    check_sources,
    document_citations,
    references_values,
)

FEATURE = Feature(
    name="references",
    citations=document_citations,
    check=check_sources,
    pages=(
        PageKind(
            name="references",
            values=references_values,
            exists=lambda library: bool(references_values(library)["entries"]),
            order=25,
        ),
    ),
    rules=(
        Rule("source-unknown", "error", "A text cites a source that the list does not have."),
        Rule(
            "source-malformed",
            "error",
            "An entry of the list of sources cannot be read.",
            "Only its author knows what was meant.",
        ),
        Rule(
            "source-style",
            "error",
            "The course's style for citations cannot be used.",
            "A file has to be written anew; an edit changes texts only.",
        ),
        Rule(
            "source-unused",
            "warning",
            "No text cites a source of the list.",
            "Only its author knows what was meant.",
        ),
        Rule(
            "source-identifier",
            "warning",
            "A source has no DOI or ISBN, or not a valid one.",
            "The number is in the work, or in a catalogue.",
        ),
    ),
)
