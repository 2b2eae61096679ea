"""Sequential analysis put to the test: how often its promise is kept on truths that are known, and what it saves."""
