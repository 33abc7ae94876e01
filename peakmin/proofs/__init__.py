"""The least peak past windows in continuous time, and why nothing is less. numpy and scipy only."""
