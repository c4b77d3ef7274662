"""`python -m coursebuild`."""

import os
import sys

# Python looks for modules in the working folder first: a course must not bring any of the tool's.
_home = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # noqa: PTH100, PTH120
if not sys.flags.safe_path and os.path.realpath(sys.path[0]) != os.path.realpath(_home):
    del sys.path[0]

from coursebuild.cli import main  # noqa: E402

sys.exit(main())
