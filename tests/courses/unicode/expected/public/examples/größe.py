# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
# Ein Kommentar: 注釈, הערה
größe = 1.25
print("größe =", größe)
print("質量", 2, "kg")
print("זווית", "-0.50", "rad")
print("école é n̈ 👩🏽‍🔬")
print("wide:", "　".join("一二三"))
