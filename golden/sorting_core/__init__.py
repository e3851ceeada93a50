"""The sorting core: keeps the tables of the tiles in depth order from frame to frame."""
