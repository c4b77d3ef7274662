# Café

# %% [markdown]
# A cell

# %%
print(1)
