"""The source paper's claims on its damping laws, judged by sensitivity studies: docs/paper.md."""
