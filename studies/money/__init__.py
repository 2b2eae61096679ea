"""Money: what a later saving is worth today, and the best that a sum can buy."""
