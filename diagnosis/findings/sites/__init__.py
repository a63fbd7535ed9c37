"""The sites from which a laboratory's residuals may come, by the readings that each of them changes."""
