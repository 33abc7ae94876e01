"""A row that ends its process, for `test_study`: in a module that is quickly read."""

import os

from peakmin.queries.study.row import failed


def dies(text):
    """As `solved_row`, but a duration of 1.67 s is too much for it."""
    return os._exit(9) if '"duration":1.66' in text else {**failed(""), "status": "solved"}
