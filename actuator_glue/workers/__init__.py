"""Work done in processes beside the one that asks for it."""
