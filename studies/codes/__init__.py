"""Building codes: the pieces of an inventory that must be anchored, the design forces, and checks of the anchors."""
