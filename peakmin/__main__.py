"""`python -m peakmin` is `peakmin`."""

from __future__ import annotations

from .cli import main

main()
