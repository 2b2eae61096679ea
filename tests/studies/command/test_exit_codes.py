"""Exit codes: of a signal, that of the one that ended this run, whatever ended one before; of a lost cluster."""

import signal

import pytest
from study_texts import crate_study

from toppling.fragility.runs.cluster import ClusterError
from toppling.studies.command import cli, status
from toppling.studies.kinds.study import Study
from toppling.studies.store.watch import Stop


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_signal_that_was_sent(tmp_path, monkeypatch, capsys, number):
    """The first signal is asked for while chunks are in flight, and what is kept is told."""
    (tmp_path / "study.toml").write_text(crate_study("Signals", 3, 6, 0.02, 3), encoding="utf-8")
    asked = Stop.__call__

    def call(self):
        if not self.asked:
            signal.raise_signal(number)
        return asked(self)

    monkeypatch.setattr(Stop, "__call__", call)
    out = str(tmp_path / "out")
    assert cli.main(["run", str(tmp_path / "study.toml"), "--out", out]) == 128 + number
    assert "interrupted with" in capsys.readouterr().err
    monkeypatch.undo()

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(status, "status_of", interrupted)
    assert cli.main(["status", out]) == 130


def test_a_lost_cluster_is_no_wrong_input(tmp_path, monkeypatch, capsys):
    """Code 1, as docs/scaling.md promises: the same command goes on, which after wrong input (code 2) it does not."""
    (tmp_path / "study.toml").write_text(crate_study("Lost", 3, 6, 0.02, 3), encoding="utf-8")

    def lost(*_, **__):
        raise ClusterError("the scheduler at tcp://10.0.0.1:8786 is gone")

    monkeypatch.setattr(Study, "run", lost)
    assert cli.main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 1
    assert "8786 is gone; what is finished is kept: run the same command again" in capsys.readouterr().err
