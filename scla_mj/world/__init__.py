"""The physical world: the arena and the robot as one MuJoCo model, its spawns, its poses and its faults. No neurons here."""
