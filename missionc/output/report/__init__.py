"""The report: one page that shows a plan in motion next to the text of the mission."""
