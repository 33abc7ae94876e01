"""What is asked and how: models, their one-line refusals, their files."""
