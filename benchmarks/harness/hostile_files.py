"""Configurations and metrics that nobody would write, and somebody may have."""

import copy
import io
import random
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from benchmarks.harness.sandbox import CANARY
from benchmarks.harness.values import TEXTS, mutated

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 9)}]\n" for level in range(1, 12)
)
WHOLE = (
    *(b"", b"\0" * 100, b"\xff\xfe\0x", "algorithm: é".encode("latin-1"), "algorithm: 1".encode("utf-16")),
    *(
        b"[" * 20_000,
        b"{" * 20_000,
        b"a: " * 5_000,
        b"- " * 20_000,
        b"? " * 3_000,
        b"%YAML 9.9\n---\n",
        b"--- 1\n--- 2",
    ),
    *(
        b"a: &a [*a]",
        b"&a {algorithm: *a, environment: *a, run: *a}",
        b"*nothing",
        b"!!binary x",
        b"!!set {a, b}",
    ),
    *(
        BOMB.encode(),
        b"? [a]\n: 1",
        b"<<: 5",
        b"!!python/object/apply:os.system [touch escaped]",
        b"5",
        b"\xef\xbb\xbfa: 1",
    ),
    *(
        b"2001-99-99",
        b"a: 2001-99-99",
        b"9" * 5000,
        b"a: " + b"9" * 5000,
        b"!!int x",
        b"!!float x",
        b"1:99:99",
        b"\t",
        b"@",
    ),
    *(
        b"!!timestamp x",
        b"!!null x",
        b"!!bool x",
        b"!!omap x",
        b"!!pairs [1]",
        b'"\\ud800"',
        b'"\\xzz"',
        b"a: b: c",
    ),
    *(f"!!python/module:{CANARY}".encode(), f"!!python/name:{CANARY}.World".encode(), b"a" * 1_000_000),
)
PIECES = (
    *(
        "&a [*a]",
        "&a {b: *a}",
        "!!binary x",
        "!!binary aGVsbG8=",
        "!!set {a}",
        "2001-01-01",
        "2001-99-99",
        "1e999",
        ".nan",
    ),
    *(
        "-.inf",
        "9" * 5000,
        "-" + "9" * 30,
        "[]",
        "{}",
        "[[[[1]]]]",
        "{a: {b: {c: 1}}}",
        "null",
        "true",
        '"\\0"',
        '"a\\nb"',
    ),
    *(
        '"\\ud800"',
        "0o17",
        "1:60",
        "!!python/tuple [1]",
        "'" + "x" * 5000 + "'",
        "[" + "1, " * 3000 + "1]",
        "{1: 2}",
    ),
    *(
        "{null: 1}",
        "{[a]: 1}",
        "!!int '9'",
        "-0",
        "0.5",
        "-1",
        "1",
        "3",
        "18446744073709551616",
        '"\\e[31m"',
        "{? {a: 1} : 2}",
    ),
    *(
        f"{CANARY}:World",
        f"{CANARY}.py:World",
        f"{{near: '{CANARY}:near'}}",
        "os:system",
        "[" * 900 + "]" * 900,
    ),
)


def draw_config(base: dict[str, Any], dice: random.Random) -> bytes:
    """A configuration file: hostile as a whole, in one place, or in a few bytes."""
    text = yaml.safe_dump(base, sort_keys=False)
    kind = dice.random()
    if kind < 0.15:
        return dice.choice(WHOLE)
    if kind < 0.3:
        return mutated(text, dice).encode(errors="replace")
    if kind < 0.45:
        raw = bytearray(text.encode())
        for _ in range(dice.choice((1, 1, 2, 20))):
            raw[dice.randrange(len(raw))] = dice.randrange(256)
        return bytes(raw)
    changed = copy.deepcopy(base)
    for _ in range(dice.choice((1, 1, 2))):
        _change(changed, dice)
    text = yaml.safe_dump(changed, sort_keys=False)
    for number, piece in enumerate(PIECES):
        text = text.replace(f"piece-{number}-", piece)
    return text.encode(errors="replace")


def _change(section: dict[str, Any], dice: random.Random) -> None:
    """Replaces, drops or adds something, on any level."""
    name = dice.choice(list(section)) if section else "x"
    if isinstance(section.get(name), dict) and section[name] and dice.random() < 0.85:
        _change(section[name], dice)
        return
    piece = f"piece-{dice.randrange(len(PIECES))}-"
    match dice.randrange(8):
        case 0:
            section.pop(name, None)
        case 1:
            section[dice.choice(("class", "name", "module", "skills", "trust", "<<", "x" * 3000))] = piece
        case 2:
            section[name] = dice.choice([text for text in TEXTS if text.isascii()])
        case 3:
            section[piece] = 1
        case _:
            section[name] = piece


def draw_metrics(whole: bytes, dice: random.Random) -> bytes:
    """A metrics file: bytes of a good one changed, or another table altogether."""
    kind = dice.random()
    if kind < 0.3:
        raw = bytearray(whole)
        for _ in range(dice.choice((1, 3, 30))):
            raw[dice.randrange(len(raw))] = dice.randrange(256)
        return bytes(raw)
    if kind < 0.4:
        return dice.choice(
            (b"", b"PAR1", b"PAR1PAR1", whole[: dice.randrange(len(whole))], b"a,b\n1,2\n", *WHOLE[:4])
        )
    return _table(pq.read_table(io.BytesIO(whole)), dice)


ODD_NUMBERS = (None, -1, 0, 2**62, float("nan"), float("inf"), -1e300)
ODD_VALUES = (*ODD_NUMBERS, "x", True, b"\xff", [1], {"a": 1})


def _table(table: pa.Table, dice: random.Random) -> bytes:
    """Fewer rows, fewer columns, and columns of other values, throughout or in one row."""
    rows = dice.choice((0, 1, table.num_rows, table.num_rows, table.num_rows))
    columns = {name: table.column(name).slice(0, rows) for name in table.column_names}
    keys = ("seed", "generation", "environment_steps", "success_rate", "team_return")
    for _ in range(dice.choice((1, 1, 2, 4))):
        name = dice.choice([name for name in keys if name in columns] or list(columns) or ["x"])
        match dice.randrange(3):
            case 0:
                columns.pop(name, None)
            case 1:
                columns[name] = pa.array([dice.choice(ODD_VALUES)] * rows)
            case _ if rows and name in table.column_names:
                odd = dice.choice(ODD_NUMBERS)
                values = [float(value) for value in table.column(name).slice(0, rows).to_pylist()]
                values[dice.randrange(rows)] = odd if odd is None else float(odd)
                columns[name] = pa.array(values, pa.float64())
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()
