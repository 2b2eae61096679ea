"""Two studies' results side by side: what differs between them, and whether the motions explain the difference."""
