"""Maneuvers of least peak base reaction force, each with a proof.

    import peakmin as pm
    plan = pm.solve(pm.Maneuver(start=pm.State(position=(0, 0)), goal=pm.State(position=(1, 0)), duration=1.0))

The names stand in `__init__.pyi`, each with its module, which is loaded when the name is first asked for: reading a
spec does not wait for what solves it.
"""

from importlib.metadata import version

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = version("peakmin")
