"""Values that no option and no field expects."""

import random

TEXTS = (
    *("", " ", "-", "--", "-1", "0", "1", "2", "7", "+3", "1.5", "1e999", "-1e999", "1e-320", "1e18", "1e19"),
    *("nan", "NaN", "-nan", "inf", "-inf", "Infinity", "9" * 30, "9" * 5000, "0x10", "1_000", "1__0", "٣"),
    *("1,2", "1,,2", "5..3", "0..99999999999999999999", "3..3", "99999999999999999999", "9" * 5000 + ","),
    *(
        "true",
        "false",
        "True",
        "none",
        "None",
        "null",
        "default",
        "~",
        "[",
        "[1]",
        "{a: b}",
        "&a *a",
        "!!int x",
    ),
    *(
        "A+B",
        "A",
        "B:A",
        "B:A,A:B",
        "A:A",
        "Z:Z",
        "B:A+",
        "a=b",
        "N=1e999",
        "N=[1]",
        "a=!!python/name:os.system",
    ),
    *(
        "a=2001-99-99",
        "a=" + "[" * 2000,
        "scout:rovers=2",
        "scout:rovers=nan:coupling=1",
        "s:rovers=" + "9" * 5000,
    ),
    *(
        "madys",
        "ea",
        "rover-t2-c1",
        "jaxmarl:",
        "jaxmarl:x",
        "gymnasium:",
        "gymnasium:No-v0",
        "pettingzoo:a.b",
    ),
    *(
        "no.such.module:Name",
        "a.b.c.d.e:F",
        "os:path",
        "os:no_such",
        ":",
        "a:",
        ":b",
        "..:x",
        ".a:b",
        "a..b:C",
    ),
    *(
        "missing.py:Name",
        "broken.py:Name",
        "folder.py:Name",
        "sys:exit",
        "json:dumps.x.y",
        "skillcrew:Environment",
    ),
    *(
        "run",
        "run/config.yaml",
        "folder",
        "file.txt",
        "empty",
        "missing/deep/er",
        "../missing",
        ".",
        "..",
        "/",
    ),
    *("/dev/null", "/dev/null/x", "/proc/self/x", "fifo", "loop", "config.yaml", "bad.yaml", "ea,madys"),
    *(
        "é",
        "漢字",
        "\u202eabc",
        "a\nb",
        "a\r\nb",
        "\x1b[31mred",
        "\udcff",
        "a\tb",
        "🤖" * 50,
        "%s%n",
        "{0}",
        "[bold]x[/]",
    ),
    *("x" * 300, "x" * 5000, "a/" * 3000, "$(touch x)", ";ls", "USR1", "KILL", "SIGALRM", "INT", "sigusr1"),
)


def mutated(text: str, dice: random.Random) -> str:
    """A text with a letter or a piece of it changed."""
    if not text:
        return dice.choice(TEXTS)
    at = dice.randrange(len(text))
    match dice.randrange(5):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + dice.choice("-=.,:+/\\'\"\n0Zé*&{[ ") + text[at:]
        case 2:
            return text[:at]
        case 3:
            return text + text
        case _:
            return text[:at] + text[at:].swapcase()
