"""Web page of a flight in progress: its data and text; the map and the lanes are those of the report."""
