"""Studio: a local web page for writing, viewing and compiling a mission.

text_file      text with its file: read, compared, saved
mission_lists  missions that can be opened
workplace      state that all pages share
planner        interface of the planner, which compiles in a separate process
compilation    compilations of one page's text
session        one page: its text, its requests and its language server
local_server   the pages and their sockets, behind ``tools.guard``
serve          the complete studio, for ``missionc studio``
"""
