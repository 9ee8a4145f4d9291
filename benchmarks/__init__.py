"""What a run costs, beside what it is made of, beside other simulators, and as it grows."""
