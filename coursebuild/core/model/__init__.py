"""The course as values: documents made of blocks and inlines, the course map, models.

Entry points: `Course`, `Document`, the unions `Block` and `Inline`, `document_blocks`,
`document_inlines`.

Every node has its `span` from birth. Nodes are frozen; a renderer or a check matches a union to its
end (`assert_never`). A document is the tree of one Markdown text: a lesson, a page, or a text
inside a quiz.
"""

from coursebuild.core.model.addresses import line_anchor as line_anchor
from coursebuild.core.model.addresses import linked_lines as linked_lines
from coursebuild.core.model.addresses import listing_anchor as listing_anchor
from coursebuild.core.model.addresses import local_file as local_file
from coursebuild.core.model.addresses import model_anchors as model_anchors
from coursebuild.core.model.addresses import output_anchor as output_anchor
from coursebuild.core.model.addresses import resolve as resolve
from coursebuild.core.model.addresses import scenario_anchor as scenario_anchor
from coursebuild.core.model.blocks import Bench as Bench
from coursebuild.core.model.blocks import BenchPart as BenchPart
from coursebuild.core.model.blocks import Block as Block
from coursebuild.core.model.blocks import BlockQuote as BlockQuote
from coursebuild.core.model.blocks import Callout as Callout
from coursebuild.core.model.blocks import Cell as Cell
from coursebuild.core.model.blocks import CodeBlock as CodeBlock
from coursebuild.core.model.blocks import Comparison as Comparison
from coursebuild.core.model.blocks import Document as Document
from coursebuild.core.model.blocks import FeatureBlock as FeatureBlock
from coursebuild.core.model.blocks import Filter as Filter
from coursebuild.core.model.blocks import Footnote as Footnote
from coursebuild.core.model.blocks import Heading as Heading
from coursebuild.core.model.blocks import HtmlBlock as HtmlBlock
from coursebuild.core.model.blocks import HtmlFlow as HtmlFlow
from coursebuild.core.model.blocks import ListBlock as ListBlock
from coursebuild.core.model.blocks import ListItem as ListItem
from coursebuild.core.model.blocks import MathBlock as MathBlock
from coursebuild.core.model.blocks import Mjcf as Mjcf
from coursebuild.core.model.blocks import Mode as Mode
from coursebuild.core.model.blocks import Paragraph as Paragraph
from coursebuild.core.model.blocks import PlainCode as PlainCode
from coursebuild.core.model.blocks import Recording as Recording
from coursebuild.core.model.blocks import Script as Script
from coursebuild.core.model.blocks import Table as Table
from coursebuild.core.model.blocks import ThematicBreak as ThematicBreak
from coursebuild.core.model.course import CalloutKind as CalloutKind
from coursebuild.core.model.course import Course as Course
from coursebuild.core.model.course import CourseFeature as CourseFeature
from coursebuild.core.model.course import Lesson as Lesson
from coursebuild.core.model.course import Level as Level
from coursebuild.core.model.course import MjcfModel as MjcfModel
from coursebuild.core.model.course import Page as Page
from coursebuild.core.model.course import Silence as Silence
from coursebuild.core.model.course import Status as Status
from coursebuild.core.model.inlines import CodeSpan as CodeSpan
from coursebuild.core.model.inlines import Emphasis as Emphasis
from coursebuild.core.model.inlines import ExampleTarget as ExampleTarget
from coursebuild.core.model.inlines import FootnoteRef as FootnoteRef
from coursebuild.core.model.inlines import HardBreak as HardBreak
from coursebuild.core.model.inlines import Image as Image
from coursebuild.core.model.inlines import Inline as Inline
from coursebuild.core.model.inlines import Label as Label
from coursebuild.core.model.inlines import LessonTarget as LessonTarget
from coursebuild.core.model.inlines import LevelTarget as LevelTarget
from coursebuild.core.model.inlines import Link as Link
from coursebuild.core.model.inlines import Math as Math
from coursebuild.core.model.inlines import Meaning as Meaning
from coursebuild.core.model.inlines import ModelTarget as ModelTarget
from coursebuild.core.model.inlines import NumberBinding as NumberBinding
from coursebuild.core.model.inlines import PageTarget as PageTarget
from coursebuild.core.model.inlines import RawInline as RawInline
from coursebuild.core.model.inlines import SoftBreak as SoftBreak
from coursebuild.core.model.inlines import Strikethrough as Strikethrough
from coursebuild.core.model.inlines import Strong as Strong
from coursebuild.core.model.inlines import Target as Target
from coursebuild.core.model.inlines import Term as Term
from coursebuild.core.model.inlines import TermTarget as TermTarget
from coursebuild.core.model.inlines import Text as Text
from coursebuild.core.model.inlines import UrlTarget as UrlTarget
from coursebuild.core.model.inlines import plain_text as plain_text
from coursebuild.core.model.interactive import Lab as Lab
from coursebuild.core.model.interactive import LabCamera as LabCamera
from coursebuild.core.model.interactive import LabControl as LabControl
from coursebuild.core.model.interactive import LabExpect as LabExpect
from coursebuild.core.model.interactive import LabPlot as LabPlot
from coursebuild.core.model.interactive import LabReadout as LabReadout
from coursebuild.core.model.interactive import LabStep as LabStep
from coursebuild.core.model.interactive import LabTrace as LabTrace
from coursebuild.core.model.lexicon import DefinedTerm as DefinedTerm
from coursebuild.core.model.lexicon import Equation as Equation
from coursebuild.core.model.lexicon import Lexicon as Lexicon
from coursebuild.core.model.lexicon import SymbolUse as SymbolUse
from coursebuild.core.model.scenarios import Declarations as Declarations
from coursebuild.core.model.scenarios import DeclaredScenario as DeclaredScenario
from coursebuild.core.model.scenarios import Keep as Keep
from coursebuild.core.model.scenarios import Measured as Measured
from coursebuild.core.model.scenarios import Visible as Visible
from coursebuild.core.model.walk import block_inlines as block_inlines
from coursebuild.core.model.walk import child_blocks as child_blocks
from coursebuild.core.model.walk import document_blocks as document_blocks
from coursebuild.core.model.walk import document_has as document_has
from coursebuild.core.model.walk import document_inlines as document_inlines
from coursebuild.core.model.walk import document_scripts as document_scripts
from coursebuild.core.model.walk import is_blank as is_blank
from coursebuild.core.model.walk import walk_blocks as walk_blocks
from coursebuild.core.model.walk import walk_inlines as walk_inlines
