# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
import secrets

print("this is run", secrets.token_hex(4), "of many")
