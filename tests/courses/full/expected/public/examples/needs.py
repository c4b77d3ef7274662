# /// script
# requires-python = ">=3.11"
# dependencies = [
#     "no_such_module_here",
# ]
# ///
import no_such_module_here
