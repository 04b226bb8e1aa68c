"""Fields' docstrings are the command line's help: each field has one, of two lines at most."""

import ast
from pathlib import Path

import skillcrew

SOURCE = Path(skillcrew.__file__).parent


def configurations():
    """Every dataclass whose name says that it is made of options, and its file."""
    for file in sorted(SOURCE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ClassDef) and node.name.endswith(("Config", "Options")):
                yield file.relative_to(SOURCE), node


def test_every_option_is_explained_briefly():
    looked_at, faults = 0, []
    for file, node in configurations():
        for field, following in zip(node.body, [*node.body[1:], None], strict=True):
            if not isinstance(field, ast.AnnAssign) or "ClassVar" in ast.unparse(field.annotation):
                continue
            looked_at += 1
            said = getattr(following, "value", None) if isinstance(following, ast.Expr) else None
            if not (isinstance(said, ast.Constant) and isinstance(said.value, str)):
                faults.append(f"{file}: {node.name}.{ast.unparse(field.target)} has no docstring")
            elif following.end_lineno - following.lineno > 1:
                faults.append(f"{file}: {node.name}.{ast.unparse(field.target)} takes more than two lines")
    assert looked_at > 100
    assert not faults
