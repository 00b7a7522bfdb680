"""Watch mode: missions are checked and planned again on every save.

file_changes      detection of complete saves of watched files
watched_missions  missions with their included files, checked again
planner_process   planning in a separate process, which can be stopped
live_page         the report as a page that is updated
loop              the complete watch mode, for ``compile --watch``
"""
