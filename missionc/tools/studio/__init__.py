"""The studio: a local page for writing, viewing and compiling a mission.

pieces         shapes as written → what of them a drag may edit
scene          a text → what the map shows
text_file      the file behind a text: read, compared, saved
mission_lists  the missions that can be opened
open_mission   the text that a page has, and where it may be saved
studio_lsp     the language server of one page
workplace      what all pages share
planner        what a compilation asks of the process that compiles
compilation    the compilations of one page's text
session        one page's requests, and their answers
local_server   the pages and their sockets, for whom ``tools.guard`` lets in
serve          all of it together, for ``missionc studio``
"""
