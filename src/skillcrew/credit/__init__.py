"""Who in a team deserves the reward: difference rewards and what they stand on."""
