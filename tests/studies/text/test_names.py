"""Names of users, as they are shown."""

import pytest

from toppling.studies.text.names import clean


@pytest.mark.parametrize("mark", "\x00\x1b\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
def test_marks_that_change_what_follows_are_replaced(mark):
    assert clean(f"a{mark}b") == "a\ufffdb"
