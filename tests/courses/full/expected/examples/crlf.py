text = """one
two"""
print(repr(text))
