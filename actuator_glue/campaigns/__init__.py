"""Campaigns: thousands of records, a row each, and what the rows say of an actuator."""
