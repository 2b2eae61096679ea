"""`toppling` with chunks of a few hundredths of a second, as a process of its own for tests that kill it.

Started as `python small_chunks.py run STUDY.toml …`; nothing else differs from the command.  It says "computing" on
standard output when the first chunk is done.
"""

import sys

from toppling.fragility.runs import plan
from toppling.studies.command import cli
from toppling.studies.store import progress

LEAST_SECONDS = 0.02


def main() -> int:
    """The command, with small chunks."""
    assert plan.LEAST_SECONDS > LEAST_SECONDS
    plan.LEAST_SECONDS = plan.CHUNK_SECONDS = LEAST_SECONDS
    update = progress.Display.update

    def told(self, done, total):
        if not getattr(self, "begun", False):
            self.begun = True
            print("computing", flush=True)
        update(self, done, total)

    progress.Display.update = told
    return cli.main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
