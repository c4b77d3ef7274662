"""The course as values: documents made of blocks and inlines, the course map, models.

Entry points: `Course`, `Document`, the unions `Block` and `Inline`, `document_blocks`,
`document_inlines`.

Every node has its `span` from birth. Nodes are frozen; a renderer or a check matches a union to its
end (`assert_never`). A document is the tree of one Markdown text: a lesson, a page, or a text
inside a quiz.
"""

# ruff: noqa: F403
from coursebuild.core.model.addresses import *
from coursebuild.core.model.blocks import *
from coursebuild.core.model.course import *
from coursebuild.core.model.inlines import *
from coursebuild.core.model.scenarios import *
from coursebuild.core.model.walk import *
