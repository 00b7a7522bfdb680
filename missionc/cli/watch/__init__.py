"""Watch mode: missions that are checked and planned again on every save.

saves      which files have changed, and come to rest
missions   missions with what they include, checked again
planner    plans in a process of its own, and can be told to stop
live       the report as a page that follows
loop       all of it together, for ``compile --watch``
"""
