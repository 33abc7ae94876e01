"""The answer, its file, its verification. Reaches no solver."""
