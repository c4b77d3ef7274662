"""`python -m coursebuild`."""

import sys

from coursebuild.cli import main

sys.exit(main())
