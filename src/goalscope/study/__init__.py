"""Studies in which people rate episodes, as in the paper's human evaluation (Sec. 5.2)."""
