"""The documentation as a site: ``make docs``. The Markdown in ``docs/`` is the source and stays readable on its own.

pages        the pages in their order, and where each lies on the site
generated    pages made from what is there: codes, the Python API, missions, examples, changes
stage        pages → a folder as the generator takes it
links        the built HTML → every link, anchor and picture that leads nowhere
__main__     all of it, in order
"""
