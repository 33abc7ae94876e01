"""Many problems: who solves them, what is kept, the table."""
