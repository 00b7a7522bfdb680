"""DXF drawings: blocks, shapes and curves of their entities."""
