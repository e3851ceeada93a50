"""The raster core: which subtiles a Gaussian touches, and what it does to their pixels."""
