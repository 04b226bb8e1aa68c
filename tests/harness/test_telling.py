"""What long harnesses say on the way."""

from benchmarks.harness import telling


def test_problems_are_told_at_once_and_progress_now_and_then(monkeypatch, capsys):
    monkeypatch.setattr(telling, "SECONDS", 0.0)
    problems, seen = [], []
    for case in telling.told(range(5, 8), problems):
        seen.append(case)
        problems += ["six is odd"] if case == 6 else []
    assert seen == [5, 6, 7]
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["1 of 3 in 0 s", "six is odd", "2 of 3 in 0 s", "3 of 3 in 0 s"]


def test_short_ones_say_nothing(capsys):
    assert list(telling.told(range(3), [])) == [0, 1, 2]
    assert capsys.readouterr().err == ""
