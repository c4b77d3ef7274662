"""`coursebuild lsp`: what an editor shows and offers while a course is written.

It needs the package pygls, of the extra `lsp`.
"""

from coursebuild.api import Command, Feature

FEATURE = Feature(
    name="language_server",
    needs=("authoring", "glossary", "names", "references", "symbols"),
    commands=(
        Command(
            name="lsp",
            summary="run the language server for an editor",
            module=f"{__name__}.commands.lsp",
        ),
    ),
)
