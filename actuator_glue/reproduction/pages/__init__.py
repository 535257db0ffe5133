"""Sections of the report: text, tables and figures from the study's numbers."""
