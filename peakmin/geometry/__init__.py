"""Sets, motions and the distances between them: arrays only, shapes (..., d)."""
