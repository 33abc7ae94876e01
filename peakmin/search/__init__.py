"""From a task to its plan."""
