"""1000 Izhikevich neurons with dopamine-modulated STDP, compiled."""
