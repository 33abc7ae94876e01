"""What the centre of mass moves in: classes of paths, and what a motion keeps."""
