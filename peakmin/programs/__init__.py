"""Controls on holds, which solvers propose. The only place that imports cvxpy."""
