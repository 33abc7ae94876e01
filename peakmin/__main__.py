"""`python -m peakmin` is `peakmin`."""

from .cli import main

main()
