"""A house without Unity: AI2-THOR's actions, metadata, failures and effects."""
