"""The verbs that take any kind of task or plan, by the names that were theirs."""

from __future__ import annotations

from .plan.verify import verify
from .queries.explain import explain
from .search.solve import solve

__all__ = ["explain", "solve", "verify"]
