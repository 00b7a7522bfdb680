"""Watch mode: missions are checked and planned again on every save.

saves      files that have changed and are complete
missions   missions with their includes, checked again
planner    planning in a separate process, which can be stopped
live       the report as a page that follows
loop       all of it together, for ``compile --watch``
"""
