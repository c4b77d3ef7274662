# /// script
# requires-python = ">=3.11"
# dependencies = [
#     # the package of the module no_such_module_here was not known
# ]
# ///
import no_such_module_here
