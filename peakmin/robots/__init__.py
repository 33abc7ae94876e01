"""The arm itself: kinematics, joints, links among obstacles. Arrays only."""
