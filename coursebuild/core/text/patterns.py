"""`pattern` is `re.compile`; modules that still import it from here are to use that."""

import re

pattern = re.compile
