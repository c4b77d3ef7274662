"""The course as frozen values, every node with its span: documents, the course map, models."""

# ruff: noqa: F403
from coursebuild.core.model.addresses import *
from coursebuild.core.model.blocks import *
from coursebuild.core.model.course import *
from coursebuild.core.model.inlines import *
from coursebuild.core.model.scenarios import *
from coursebuild.core.model.walk import *
