"""Arms: from the workspace to the centre of mass and back.

One way through: spec -> kinematics -> workspace -> passage -> proof -> tree, turn -> search -> solve -> plan; figures,
documents, the simulation and the comparison are at the edge.
"""
