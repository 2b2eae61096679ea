"""Films of a rocking block: the frames, the scene that a frame shows, and the writers of GIF and MP4."""
