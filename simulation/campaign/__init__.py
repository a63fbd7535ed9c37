"""Campaigns of tests: the goal, the next test, the log by which a campaign goes on after an interruption."""
