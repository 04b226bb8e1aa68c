"""Options that harnesses share."""

import argparse
from collections.abc import Sequence


def harness_parser(about: str | None) -> argparse.ArgumentParser:
    """A parser that shows a module's text as it stands, and knows `--seed`."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn at random (default: 0)")
    return parser


def parse_algorithms(about: str | None, count: int, algorithms: Sequence[str]) -> argparse.Namespace:
    """Options of what befalls runs of several algorithms: so often, and which.

    Args:
        count, algorithms: the defaults.
    """
    parser = harness_parser(about)
    parser.add_argument("--count", type=int, default=count, help=f"how many (default: {count})")
    parser.add_argument(
        "--algorithms",
        type=lambda text: text.split(","),
        default=list(algorithms),
        help=f"which, joined by commas (default: {','.join(algorithms)})",
    )
    return parser.parse_args()
