"""Who is answered, and with what: nothing of a run folder runs, nothing is changed, nothing else is shown."""

import json
import socket
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analysis.page import meadow
from analysis.studio.folders import EVIL, STEPS, grow, write_run
from experiment import tiny
from skillcrew.analysis.page.assemble import assemble
from skillcrew.analysis.page.contents import describe
from skillcrew.analysis.studio import run_page
from skillcrew.analysis.studio.guard import Guard
from skillcrew.cli.main import run_command
from skillcrew.experiment.integrity import write_known


def test_curves_of_chosen_runs_are_in_one_panel_for_each_environment(studio, root):
    write_run(root / "a", 0.5)
    write_run(root / "b", 1.0)
    write_run(root / "c", 1.0, environment="forest")
    write_run(root / "d")
    drawn = studio.curves("a", "b", "c", "d")
    labels = {
        panel["environment"]: [curve["label"] for curve in panel["curves"]] for panel in drawn["panels"]
    }
    assert labels == {"meadow": ["a", "b"], "forest": ["c"]}
    assert drawn["missing"] == [["d", "no generation is over yet"]]
    (a, b) = drawn["panels"][0]["curves"]
    assert a["band"]["steps"][-1] == STEPS / 2 and b["band"]["mean"][-1] == pytest.approx(0.975, abs=0.03)
    assert len(a["seeds"]) == 2


def test_long_runs_are_thinned(studio, root):
    run = write_run(root / "run", steps=10**6)
    grow(run, 1.0, generations=20_000, steps=10**6)
    (panel,) = studio.curves("run")["panels"]
    assert len(json.dumps(panel)) < 60_000
    assert panel["curves"][0]["seeds"][0]["steps"][-1] == 10**6


@pytest.mark.parametrize(
    ("headers", "said"),
    [
        ({"Host": "evil.example:{port}"}, "evil.example"),
        ({"Host": "localhost:1"}, "localhost:1"),
        ({"Host": "localhost"}, "localhost"),
        ({"Host": "localhost:{port}@evil.example"}, "evil.example"),
        ({"Host": "evil.example#@localhost:{port}"}, "evil.example"),
        ({"Host": ""}, "''"),
        ({"Origin": "http://evil.example"}, "evil.example"),
        ({"Origin": "http://localhost:1"}, "localhost:1"),
        ({"Origin": "https://localhost:{port}"}, "https"),
        ({"Origin": "null"}, "null"),
        ({"Sec_Fetch_Site": "cross-site"}, "cross-site"),
        ({"Sec_Fetch_Site": "same-site"}, "same-site"),
    ],
)
def test_others_are_refused(headers, said, studio, root):
    write_run(root / "secret", 0.5)
    for path in ("/", "/runs", "/curves?run=x", "/page?run=x"):
        status, _, text = studio.ask(
            path, **{name: of.format(port=studio.port) for name, of in headers.items()}
        )
        assert status == 403 and said in text and "secret" not in text


def test_its_own_pages_are_answered(studio):
    for name in ("localhost", "127.0.0.1", "[::1]", "LOCALHOST"):
        host = f"{name}:{studio.port}"
        assert studio.ask("/runs", Host=host, Origin=f"http://{host}", Sec_Fetch_Site="same-origin")[0] == 200


def test_beyond_this_machine_addresses_are_answered_and_strange_names_are_not():
    guard = Guard("0.0.0.0", 8000)
    assert guard.refusal({"Host": "192.168.1.5:8000"}) is None
    assert guard.refusal({"Host": f"{socket.gethostname()}:8000"}) is None
    assert guard.refusal({"Host": "evil.example:8000"}) is not None
    assert Guard("127.0.0.1", 8000).refusal({"Host": "192.168.1.5:8000"}) is not None


def test_nothing_can_be_changed(studio, root):
    write_run(root / "run", 0.5)
    before = tiny.contents(root)
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"):
        assert studio.ask("/runs", method)[0] == 405
    status, headers, text = studio.ask("/runs", "HEAD")
    assert status == 200 and int(headers["Content-Length"]) > 50 and text == ""
    studio.curves("run")
    studio.page("run")
    assert tiny.contents(root) == before


def test_every_answer_says_that_it_is_for_nobody_else(studio):
    for path in ("/", "/runs", "/page?run=x", "/nothing", "/../../etc/passwd", "/page?run=../../etc/passwd"):
        status, headers, text = studio.ask(path)
        assert status == (200 if path in ("/", "/runs") else 404) and "root:" not in text
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Content-Type-Options"] == "nosniff" and headers["Cache-Control"] == "no-store"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert "Access-Control-Allow-Origin" not in headers


@pytest.fixture(scope="module")
def described():
    return describe([meadow.contents()], [], f"title {EVIL}")


def test_of_a_written_page_the_data_is_taken_and_no_script(studio, root, described):
    report = write_run(root / "run", 1.0) / "report"
    report.mkdir()
    sound = assemble(described, described["title"])
    hostile = sound.replace("<script>", "<script>steal()</script><script>").replace(
        "default-src 'none'", "default-src *"
    )
    (report / "report.html").write_text(hostile)
    status, headers, text = studio.page("run")
    assert status == 200 and text == sound and "steal()" not in text
    assert headers["Content-Security-Policy"].startswith("sandbox allow-scripts; default-src 'none'")
    assert "allow-same-origin" not in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    "text", ["<script>steal()</script>", '<script type="application/json" id="data">[</script>']
)
def test_what_is_no_page_of_ours_is_a_line(text, studio, root):
    report = write_run(root / "run", 1.0) / "report"
    report.mkdir()
    (report / "report.html").write_text(text)
    status, _, said = studio.page("run")
    assert status == 404 and "not a page that skillcrew wrote" in said and "<script" not in said


def test_a_page_elsewhere_is_not_followed(studio, root, tmp_path, described):
    report = write_run(root / "run", 1.0) / "report"
    report.mkdir()
    (tmp_path / "secret.html").write_text(assemble(described, "secret"))
    (report / "report.html").symlink_to(tmp_path / "secret.html")
    status, _, said = studio.page("run")
    assert status == 404 and "leads out of" in said


def made_by(monkeypatch, script):
    """Lets this take the place of `skillcrew report`: it gets RUN --out FOLDER."""
    monkeypatch.setattr(run_page, "COMMAND", ("/bin/sh", "-c", script, "report"))


def until_made(studio, name):
    status, headers, text = studio.page(name)
    assert status == 200 and headers["Refresh"] and "is being made" in text
    while headers["Refresh"]:
        time.sleep(0.01)
        _, headers, text = studio.page(name)
    return text


def test_a_page_is_made_where_there_is_a_champion(studio, root, tmp_path, monkeypatch, described):
    run = write_run(root / "run", 1.0)
    assert "no champion yet" in studio.page("run")[2]
    (run / "checkpoints" / "20").mkdir(parents=True)
    assert studio.runs()["run"]["page"] == "makeable"
    sound = assemble(described, described["title"])
    (tmp_path / "made.html").write_text(sound)
    made_by(monkeypatch, f'echo >> {tmp_path}/times; mkdir -p "$3"; cp {tmp_path}/made.html "$3"/report.html')
    before = tiny.contents(root)
    assert until_made(studio, "run") == sound
    assert studio.page("run")[2] == sound and (tmp_path / "times").read_text() == "\n"
    assert tiny.contents(root) == before, "it is kept elsewhere"


def test_why_a_page_cannot_be_made_is_a_line(studio, root, monkeypatch):
    (write_run(root / "run", 1.0) / "checkpoints" / "20").mkdir(parents=True)
    made_by(monkeypatch, f"echo 'skillcrew: {EVIL} is not trusted' >&2; exit 2")
    said = until_made(studio, "run")
    assert "is not trusted" in said and EVIL not in said


def test_what_a_name_of_a_class_stands_for_is_not_imported_for_a_page(root, tmp_path, monkeypatch, capsys):
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nclass Evil: ...\n")
    monkeypatch.syspath_prepend(tmp_path)
    run = write_run(root / "run", 1.0)
    text = (run / "config.yaml").read_text().replace("nobody_imports_this:Meadow", "evil:Evil")
    write_known(run / "config.yaml", lambda path: path.write_text(text))
    # What the studio starts, but in this process.
    words = run_page.COMMAND[run_page.COMMAND.index("report") :]
    assert run_command([*words, str(run), "--out", str(tmp_path / "page")]) == 2
    assert "--trust" in capsys.readouterr().err and not (tmp_path / "ran").exists()


def test_a_port_that_is_taken_is_one_line(studio, root, capsys):
    assert run_command(["studio", str(root), "--port", str(studio.port)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"--port {studio.port}: " in said and "give another" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["no such folder"], "no such folder"),
        ([".", "--port", "70000"], "65535"),
        ([".", "--host", "no.such.host.invalid"], "--host no.such.host.invalid"),
        ([], "RUNS is missing"),
    ],
)
def test_mistakes_are_one_line(words, said, capsys):
    assert run_command(["studio", *words]) == 2
    printed = capsys.readouterr().err
    assert said in printed and printed.count("\n") == 1


def test_ctrl_c_is_its_end(root, capsys, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("socketserver.BaseServer.serve_forever", interrupt)
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert run_command(["studio", str(root), "--port", "0", "--open"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{root} at http://127.0.0.1:") and opened[0] in said


def test_whoever_opens_it_to_others_is_told(root, capsys, monkeypatch):
    monkeypatch.setattr("socketserver.BaseServer.serve_forever", lambda *_: None)
    assert run_command(["studio", str(root), "--port", "0", "--host", "0.0.0.0"]) == 0
    assert "whoever reaches 0.0.0.0 can look" in capsys.readouterr().err


def test_numbers_that_are_none_are_drawn_as_gaps(studio, root):
    run = write_run(root / "run", 1.0)
    table = pq.read_table(run / "metrics.parquet")
    values = np.where(np.arange(len(table)) % 7 == 3, np.inf, np.nan).astype(np.float32)
    table = table.set_column(table.schema.get_field_index("success_rate"), "success_rate", pa.array(values))
    write_known(run / "metrics.parquet", lambda path: pq.write_table(table, path))
    assert studio.runs()["run"]["score"] == "–"
    assert studio.curves("run")["panels"]
