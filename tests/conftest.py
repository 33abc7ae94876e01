import hypothesis
import matplotlib

import peakmin as pm

matplotlib.use("Agg")
# the same examples every time: a failure in `make test` is the change's, not the day's
hypothesis.settings.register_profile("repeatable", derandomize=True, deadline=None)
hypothesis.settings.load_profile("repeatable")


def wall_maneuver(contact="clear", **changes):
    """The paper's general problem, T = 1."""
    return pm.Maneuver(
        **{
            "start": pm.State(position=(0, 0)),
            "goal": pm.State(position=(1, 0)),
            "duration": 1.0,
            "obstacles": (pm.Wall(tip=(0.5, 0.5), contact=contact),),
            **changes,
        }
    )


def least(maneuver, times=(), **settings):
    """Bracket [m/s^2] at given obstacle times, as (lower, upper)."""
    from peakmin.least import LeastPeak

    peak = LeastPeak(maneuver, pm.Settings(**settings))
    bracket = peak(times)
    unit = peak.mass.unit
    return bracket.lower * unit, bracket.upper * unit
