"""Words, figures, pages. Computes nothing."""
