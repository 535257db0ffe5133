"""Terms that are learned from records: their forms, sizes and descriptions."""
