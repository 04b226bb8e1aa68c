"""Run folders that lead elsewhere: links, pipes, devices, files in place of folders and the reverse."""

import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.harness.values import TEXTS

ODD_JSON = (
    *(
        "",
        "null",
        "5",
        "[]",
        '"x"',
        "{}",
        '{"format": 4}',
        '{"format": true}',
        '{"format": 1e999}',
        "[" * 100_000,
    ),
    *(
        '{"format": 4, "generation": -1, "buffer": 5, "score": NaN}',
        '{"format": ' + "9" * 5000 + "}",
        "NaN",
        "1e999",
    ),
    *(
        '{"format": 4, "generation": "x", "buffer": null, "score": "x"}',
        '{"format": 4, "buffer": true, "score": 1' + "0" * 400 + "}",
    ),
    *(
        '{"config.yaml": ["x"]}',
        '{"../../victim/letter.txt": ["x"]}',
        '{"a\\nb": ["x"]}',
        '{"\\u0000": ["x"]}',
    ),
    *(
        '{"' + "x" * 300 + '": ["x"]}',
        '{"' + "x/" * 3000 + '": []}',
        '{"": ["x"]}',
        '{"/": []}',
        '{"/dev/zero": ["x"]}',
    ),
    *(
        '{"\\ud800": ["x"]}',
        '{"metrics.parquet": []}',
        '{"\\u001b[31m": []}',
        '{"about.json": ["' + "x" * 5000 + '"]}',
        "\0\0\0",
    ),
)


def draw_folder(folder: Path, victim: Path, dice: random.Random) -> str:
    """Makes one thing, or two, of a run folder hostile, and says what."""
    return " and ".join(_one(folder, victim, dice) for _ in range(dice.choice((1, 1, 2))))


def _one(folder: Path, victim: Path, dice: random.Random) -> str:
    paths = [
        "config.yaml",
        "metrics.parquet",
        "timing.json",
        "digests.json",
        "owner.lock",
        "checkpoints",
        "report",
    ]
    inner = [path for path in sorted((folder / "checkpoints").glob("*/**/*")) if not path.is_symlink()]
    tops = sorted((folder / "checkpoints").glob("*"))
    chosen = dice.choice((paths, paths, [str(path.relative_to(folder)) for path in inner or tops] or paths))
    if chosen is not paths and dice.random() < 0.6 and tops:
        top = dice.choice(tops)
        chosen = [
            str((top / name).relative_to(folder)) for name in ("", "about.json", "digests.json", "state")
        ]
    name = dice.choice(chosen)
    change = dice.choice(CHANGES)
    try:
        change(folder / name, victim, dice)
    except OSError as error:
        return f"{change.__name__} {name} ({error})"
    return f"{change.__name__} {name}"


def _cleared(path: Path) -> Path:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        # A pipe, which one change may have put there, would keep the next one waiting.
        path.unlink(missing_ok=True)
    return path


def link_to_victim(path: Path, victim: Path, dice: random.Random) -> None:
    target = victim / "folder" if path.is_dir() else victim / "letter.txt"
    _cleared(path).symlink_to(dice.choice((target, victim / "missing.txt", victim / "folder")))


def link_to_device(path: Path, victim: Path, dice: random.Random) -> None:
    _cleared(path).symlink_to(dice.choice(("/dev/zero", "/dev/null", "/proc/self/mem", path)))


def link_to_itself_elsewhere(path: Path, victim: Path, dice: random.Random) -> None:
    moved = victim / "moved"
    shutil.move(path, moved)
    path.symlink_to(moved)


def pipe(path: Path, victim: Path, dice: random.Random) -> None:
    os.mkfifo(_cleared(path))


def folder_in_place(path: Path, victim: Path, dice: random.Random) -> None:
    _cleared(path).mkdir()


def file_in_place(path: Path, victim: Path, dice: random.Random) -> None:
    _cleared(path).write_bytes(dice.choice(TEXTS).encode(errors="replace"))


def odd_json(path: Path, victim: Path, dice: random.Random) -> None:
    places = [path, *path.parent.glob("*.json"), *path.parent.glob("checkpoints/*/*.json")]
    place = dice.choice([place for place in places if not place.is_dir()] or [path])
    _cleared(place).write_text(dice.choice(ODD_JSON))


def huge_json(path: Path, victim: Path, dice: random.Random) -> None:
    place = path.parent / "digests.json"
    _cleared(place).write_text(json.dumps({f"file-{number}": ["0" * 64] for number in range(20_000)}))


def odd_checkpoint(path: Path, victim: Path, dice: random.Random) -> None:
    root = next(parent for parent in (path, *path.parents) if (parent / "README.txt").exists())
    name = dice.choice(("999", "007", "٣", "9" * 200, "0", "-1", ".unfinished-3", "999"))
    place = root / "checkpoints" / name
    dice.choice((Path.mkdir, lambda at: at.write_text("x"), lambda at: at.symlink_to(victim / "folder")))(
        place
    )


def no_rights(path: Path, victim: Path, dice: random.Random) -> None:
    path.chmod(0)


CHANGES: tuple[Callable[[Path, Path, random.Random], Any], ...] = (
    *(link_to_victim, link_to_victim, link_to_device, link_to_itself_elsewhere, pipe, folder_in_place),
    *(file_in_place, odd_json, odd_json, huge_json, odd_checkpoint, no_rights),
)
