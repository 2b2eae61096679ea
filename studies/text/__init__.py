"""Text of results: names of quantities, formats of numbers, notes in sentences, rows of tables, and the terminal."""
