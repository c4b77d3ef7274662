# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
print("method   error   order")
for name, error, order in (("Euler", 1.25e-2, 1), ("RK4", 3.5e-9, 4)):
    print(f"{name:8} {error:.2e} {order}")
