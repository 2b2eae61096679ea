"""Building codes: the pieces of an inventory that must be anchored, the design forces, and the anchors held to them."""
