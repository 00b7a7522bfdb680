"""The report: one page that shows a plan in motion beside the mission's own words."""
