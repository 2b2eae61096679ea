"""The plan of a study: its design and size, the estimates from its runs, and the risk that it asks for."""
