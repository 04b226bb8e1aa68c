"""`skillcrew completion SHELL`."""

from collections.abc import Mapping
from importlib.resources import files

from skillcrew.cli.present import take_places
from skillcrew.cli.vocabulary import SHELLS, vocabulary
from skillcrew.errors import UserError, unknown_name

USAGE = (
    "usage: skillcrew completion SHELL\n\n"
    f"SHELL  one of {', '.join(SHELLS)}\n\n"
    "Prints a script that completes commands, algorithms, environments, options and their values. Keep it\n"
    "in a file: making it takes seconds, completing then none. Make it anew after an update.\n\n"
    "bash   skillcrew completion bash > ~/.local/share/bash-completion/completions/skillcrew\n"
    "zsh    skillcrew completion zsh > ~/.skillcrew.zsh  # and end ~/.zshrc with: source ~/.skillcrew.zsh\n"
    "fish   skillcrew completion fish > ~/.config/fish/completions/skillcrew.fish"
)

ZSH = "autoload -Uz compinit bashcompinit\n(( $+functions[compdef] )) || compinit\nbashcompinit\n\n"
"""Lets zsh take bash's script."""


def run(words: list[str]) -> int:
    """Prints the script."""
    places = take_places(words, ("SHELL",), USAGE)
    if places is None:
        print(USAGE)
        return 0
    if more := words[1:]:
        raise UserError(f"completion: {more[0]} is too much; give one of {', '.join(SHELLS)} alone")
    if places[0] not in SHELLS:
        raise unknown_name("shell", places[0], SHELLS)
    print(script(places[0]), end="")
    return 0


def script(shell: str) -> str:
    """The script for one of `SHELLS`."""
    from skillcrew.cli.main import COMMANDS

    said = vocabulary(COMMANDS)
    tables = {"_skillcrew_place": said.place, "_skillcrew_at": said.at, "_skillcrew_value": said.value}
    fish = shell == "fish"
    render = _fish_table if fish else _bash_table
    template = (files("skillcrew.cli") / "shells" / f"completion.{'fish' if fish else 'bash'}").read_text()
    filled = template.replace("@TABLES@", "\n\n".join(render(*table) for table in tables.items()))
    return ZSH + filled if shell == "zsh" else filled


def _bash_table(name: str, table: Mapping[tuple[str, ...], str]) -> str:
    cases = [f"    {'|'.join(map(_quoted, keys))}) echo {_quoted(words)} ;;" for keys, words in table.items()]
    return "\n".join([f"{name}() {{", '    case "$1" in', *cases, "    esac", "}"])


def _fish_table(name: str, table: Mapping[tuple[str, ...], str]) -> str:
    cases = [
        f"    case {' '.join(map(_quoted, keys))}\n        echo {_quoted(words)}"
        for keys, words in table.items()
    ]
    return "\n".join([f"function {name}", "    switch $argv[1]", *cases, "    end", "end"])


def _quoted(text: str) -> str:
    return f"'{text}'"
