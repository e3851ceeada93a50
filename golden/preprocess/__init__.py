"""Preprocess: projection, culling, colour, feature records and the tiles each Gaussian touches (docs/preprocess.md)."""

from golden.preprocess.duplication import Pairs, duplicate
from golden.preprocess.encode import Features, encode
from golden.preprocess.projection import Projection, project

__all__ = ["Features", "Pairs", "Projection", "duplicate", "encode", "project"]
