"""The master: it integrates the building, and drives a laboratory of its own where the plan gives it one."""
