"""The documentation as a site: ``make docs``.

The Markdown in ``docs/`` is the source and stays readable on its own.

pages        the pages in their order, and where each lies on the site
generated    pages generated from the repository: codes, the Python API, missions, examples, changes
stage        pages → a folder for the generator
links        the built HTML → all broken links, anchors and pictures
__main__     all of it, in order
"""
