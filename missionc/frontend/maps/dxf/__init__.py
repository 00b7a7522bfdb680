"""DXF: blocks, shapes and curves of a drawing."""
