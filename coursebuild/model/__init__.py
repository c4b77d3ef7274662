"""The course as values: documents made of blocks and inlines, the course map, models.

Entry points: `Course`, `Document`, the unions `Block` and `Inline`, `document_blocks`,
`document_inlines`.

Every node has its `span` from birth. Nodes are frozen; a renderer or a check matches a union to its
end (`assert_never`). A document is the tree of one Markdown text: a lesson, a page, or a text
inside a quiz.
"""

from coursebuild.model.addresses import line_anchor as line_anchor
from coursebuild.model.addresses import linked_lines as linked_lines
from coursebuild.model.addresses import listing_anchor as listing_anchor
from coursebuild.model.addresses import local_file as local_file
from coursebuild.model.addresses import model_anchors as model_anchors
from coursebuild.model.addresses import output_anchor as output_anchor
from coursebuild.model.addresses import resolve as resolve
from coursebuild.model.addresses import scenario_anchor as scenario_anchor
from coursebuild.model.blocks import Bench as Bench
from coursebuild.model.blocks import BenchPart as BenchPart
from coursebuild.model.blocks import Block as Block
from coursebuild.model.blocks import BlockQuote as BlockQuote
from coursebuild.model.blocks import Callout as Callout
from coursebuild.model.blocks import Cell as Cell
from coursebuild.model.blocks import CodeBlock as CodeBlock
from coursebuild.model.blocks import Comparison as Comparison
from coursebuild.model.blocks import Document as Document
from coursebuild.model.blocks import FeatureBlock as FeatureBlock
from coursebuild.model.blocks import Filter as Filter
from coursebuild.model.blocks import Footnote as Footnote
from coursebuild.model.blocks import Heading as Heading
from coursebuild.model.blocks import HtmlBlock as HtmlBlock
from coursebuild.model.blocks import HtmlFlow as HtmlFlow
from coursebuild.model.blocks import ListBlock as ListBlock
from coursebuild.model.blocks import ListItem as ListItem
from coursebuild.model.blocks import MathBlock as MathBlock
from coursebuild.model.blocks import Mjcf as Mjcf
from coursebuild.model.blocks import Mode as Mode
from coursebuild.model.blocks import Paragraph as Paragraph
from coursebuild.model.blocks import PlainCode as PlainCode
from coursebuild.model.blocks import Recording as Recording
from coursebuild.model.blocks import Script as Script
from coursebuild.model.blocks import Table as Table
from coursebuild.model.blocks import ThematicBreak as ThematicBreak
from coursebuild.model.course import CalloutKind as CalloutKind
from coursebuild.model.course import Course as Course
from coursebuild.model.course import CourseFeature as CourseFeature
from coursebuild.model.course import Lesson as Lesson
from coursebuild.model.course import Level as Level
from coursebuild.model.course import MjcfModel as MjcfModel
from coursebuild.model.course import Page as Page
from coursebuild.model.course import Silence as Silence
from coursebuild.model.course import Status as Status
from coursebuild.model.inlines import CodeSpan as CodeSpan
from coursebuild.model.inlines import Emphasis as Emphasis
from coursebuild.model.inlines import ExampleTarget as ExampleTarget
from coursebuild.model.inlines import FootnoteRef as FootnoteRef
from coursebuild.model.inlines import HardBreak as HardBreak
from coursebuild.model.inlines import Image as Image
from coursebuild.model.inlines import Inline as Inline
from coursebuild.model.inlines import Label as Label
from coursebuild.model.inlines import LessonTarget as LessonTarget
from coursebuild.model.inlines import LevelTarget as LevelTarget
from coursebuild.model.inlines import Link as Link
from coursebuild.model.inlines import Math as Math
from coursebuild.model.inlines import Meaning as Meaning
from coursebuild.model.inlines import ModelTarget as ModelTarget
from coursebuild.model.inlines import NumberBinding as NumberBinding
from coursebuild.model.inlines import PageTarget as PageTarget
from coursebuild.model.inlines import RawInline as RawInline
from coursebuild.model.inlines import SoftBreak as SoftBreak
from coursebuild.model.inlines import Strikethrough as Strikethrough
from coursebuild.model.inlines import Strong as Strong
from coursebuild.model.inlines import Target as Target
from coursebuild.model.inlines import Term as Term
from coursebuild.model.inlines import TermTarget as TermTarget
from coursebuild.model.inlines import Text as Text
from coursebuild.model.inlines import UrlTarget as UrlTarget
from coursebuild.model.inlines import plain_text as plain_text
from coursebuild.model.interactive import Lab as Lab
from coursebuild.model.interactive import LabCamera as LabCamera
from coursebuild.model.interactive import LabControl as LabControl
from coursebuild.model.interactive import LabExpect as LabExpect
from coursebuild.model.interactive import LabPlot as LabPlot
from coursebuild.model.interactive import LabReadout as LabReadout
from coursebuild.model.interactive import LabStep as LabStep
from coursebuild.model.interactive import LabTrace as LabTrace
from coursebuild.model.lexicon import DefinedTerm as DefinedTerm
from coursebuild.model.lexicon import Equation as Equation
from coursebuild.model.lexicon import Lexicon as Lexicon
from coursebuild.model.lexicon import SymbolUse as SymbolUse
from coursebuild.model.scenarios import Declarations as Declarations
from coursebuild.model.scenarios import DeclaredScenario as DeclaredScenario
from coursebuild.model.scenarios import Keep as Keep
from coursebuild.model.scenarios import Measured as Measured
from coursebuild.model.scenarios import Visible as Visible
from coursebuild.model.walk import block_inlines as block_inlines
from coursebuild.model.walk import child_blocks as child_blocks
from coursebuild.model.walk import document_blocks as document_blocks
from coursebuild.model.walk import document_has as document_has
from coursebuild.model.walk import document_inlines as document_inlines
from coursebuild.model.walk import document_scripts as document_scripts
from coursebuild.model.walk import is_blank as is_blank
from coursebuild.model.walk import walk_blocks as walk_blocks
from coursebuild.model.walk import walk_inlines as walk_inlines
