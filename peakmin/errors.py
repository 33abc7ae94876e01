"""The exceptions. Infeasible and unknown are values (see `peakmin.proofs.bracket.Verdict`), never raised."""

from __future__ import annotations


class PeakminError(Exception):
    """Base class of every exception that peakmin raises on purpose."""


class SpecError(PeakminError, ValueError):
    """A spec, a setting or an argument is wrong; the message is one line naming the field."""


class NotDPPError(PeakminError):
    """A program would be compiled again at every solve (a bug in a circle or a grid)."""
