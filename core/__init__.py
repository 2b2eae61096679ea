"""What every package uses: units, checks of inputs, random streams, wording, compiled functions."""
