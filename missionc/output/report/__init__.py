"""The report: a web page that animates a plan next to the text of the mission."""
