import secrets

print("this is run", secrets.token_hex(4), "of many")
