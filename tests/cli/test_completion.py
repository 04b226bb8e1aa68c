"""Completion, in the shells that are here."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.cli.completion import script
from skillcrew.cli.main import COMMANDS, run_command
from skillcrew.cli.vocabulary import vocabulary
from skillcrew.envs.rover.presets import PRESETS

ROOT = Path(__file__).parents[2]

IN_BASH = """
source ./completion
complete -p skillcrew >&2
for line in "$@"; do
    IFS=' ' read -ra COMP_WORDS <<< "$line"
    [[ $line == *' ' ]] && COMP_WORDS+=('')
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    _skillcrew
    echo "${COMPREPLY[*]}"
done
"""
IN_FISH = """
source ./completion
for line in $argv
    echo (complete -C $line | string replace -r '\\t.*' '')
end
"""
OPENS = {"bash": ("bash", "--norc", "-c", IN_BASH, "bash"), "fish": ("fish", "--no-config", "-c", IN_FISH)}

LINES = {
    "skillcrew ": {*COMMANDS, "--help", "--version"},
    "skillcrew re": {"render", "resume", "report", "reproduce"},
    "skillcrew train madys-": {"madys-plus", "madys-es"},
    "skillcrew train ea rover-t2-c": {name for name in PRESETS if name.startswith("rover-t2-c")},
    "skillcrew check resc": {"rescue-v1-c2", "rescue-v2-c2", "rescue-v3-c3"},
    "skillcrew compare madys,cc": {"madys,ccea"},
    "skillcrew compare madys,ccea rover-t1": {"rover-t1-c3"},
    "skillcrew reproduce fig": {"fig-4.2", "fig-4.3"},
    "skillcrew completion ": {"bash", "zsh", "fish"},
    "skillcrew evaluate --ep": {"--episodes"},
    "skillcrew evaluate run --ch": {"--checkpoint"},
    "skillcrew train madys rover-t2-c2 --se": {"--seeds"},
    "skillcrew train madys rover-t2-c2 --quiet --algorithm.pop": {"--algorithm.population"},
    "skillcrew train td3 rover-t2-c2 --algorithm.pop": set(),
    "skillcrew train madys rover-t2-c2 --environment.n-a": {"--environment.n-agents"},
    "skillcrew train madys rescue-v1-c2 --environment.n-vic": {"--environment.n-victims"},
    "skillcrew resume run --on-bad-numbers r": {"roll-back"},
    "skillcrew train madys rover-t2-c2 --seeds ": set(),
    "skillcrew list --js": {"--json"},
}
"""What is typed, and all that may follow."""


@pytest.fixture(scope="module")
def scripts():
    return {shell: script(shell) for shell in ("bash", "zsh", "fish")}


@pytest.mark.parametrize("shell", OPENS)
def test_what_follows_what_is_typed(shell, scripts, tmp_path):
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell} here")
    (tmp_path / "completion").write_text(scripts[shell])
    # Of folders alone, one that is there; a world of one's own is a file.
    (tmp_path / "runs").mkdir()
    (tmp_path / "rubble.py").touch()
    lines = {**LINES, "skillcrew resume ru": {"runs"}, "skillcrew train ea rub": {"rubble.py"}}
    lines["skillcrew studio ru"] = {"runs"}
    # Nothing but the shell: neither skillcrew nor Python is found.
    environment = {"PATH": "/nowhere", "HOME": str(tmp_path), "TERM": "dumb"}
    path = shutil.which(shell)
    done = subprocess.run(
        [path, *OPENS[shell][1:], *lines], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = [set(line.replace("/", "").split()) for line in done.stdout.split("\n")[: len(lines)]]
    assert dict(zip(lines, found, strict=True)) == lines


def test_all_shells_know_the_same_words(scripts):
    def words(text):
        return {word for quoted in re.findall(r"echo '(.*?)'", text) for word in quoted.split()}

    assert words(scripts["bash"]) == words(scripts["fish"]) == words(scripts["zsh"])
    assert words(scripts["bash"]) >= {*COMMANDS, *ALGORITHMS, *PRESETS}
    assert "bashcompinit" in scripts["zsh"]


def test_a_line_for_what_is_no_shell(capsys):
    assert run_command(["completion", "csh"]) == 2
    assert "unknown shell 'csh'" in capsys.readouterr().err
    assert run_command(["completion", "bash", "--now"]) == 2
    assert "--now is too much" in capsys.readouterr().err
    assert run_command(["completion", "--help"]) == 0
    assert "completions/skillcrew" in capsys.readouterr().out


def test_pages_use_no_word_that_is_not_there():
    at = {key: options.split() for keys, options in vocabulary(COMMANDS).at.items() for key in keys}
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    lines = []
    for page in pages:
        text = page.read_text().replace("\\\n", " ")
        blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        said = [line for kind, block in blocks if kind in ("", "sh") for line in block.splitlines()]
        said += re.findall(r"`(skillcrew [^`\n]+)`", text)
        words = [shlex.split(line, comments=True) for line in said if line.startswith("skillcrew ")]
        lines += [(page.name, line) for line in words if len(line) > 1 and line[1] in COMMANDS]
    assert len(lines) > 80
    wrong = []
    for page, (_, command, *words) in lines:
        keys = [command, *(f"{command} {place} {word}" for place, word in enumerate(words[:2], start=2))]
        known = {"--version", "--trust", *(option for key in keys for option in at.get(key, ()))}
        for word in words:
            option = word.split("=")[0]
            # Of a world of one's own, nobody knows the options.
            own = option.startswith("--environment.") and ":" in " ".join(words)
            if word.startswith("--") and option not in known and not own:
                wrong.append((page, command, word))
    assert wrong == []
