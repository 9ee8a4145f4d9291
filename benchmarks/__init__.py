"""What a run costs, compared with its bare parts and with other simulators, and how that grows."""
