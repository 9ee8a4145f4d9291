"""The physical world: arena and robot as one MuJoCo model, its spawns, its poses and its faults. No neurons here."""
