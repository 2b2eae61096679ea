"""Published tests and what the package predicts of them: the table, predictions that know no outcome, and scores."""
