# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
print("a page may have scripts")
