"""What else can be asked: why not, the shortest, a budget, an oracle, studies."""
