"""The search for names: what is worth adding, what is tied, what the fitting part concludes."""
