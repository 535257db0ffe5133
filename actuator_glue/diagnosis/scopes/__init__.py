"""What a structure holds for: one record, the data since a moment, another set-up."""
