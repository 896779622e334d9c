"""Compares a JSON report from before the renames with a new one: python3 renames.py OLD.json NEW.json

Applies renames.json to OLD and prints each member that then differs from NEW. The member `wall`, the time that a run took, is
ignored. A name in renames.json may begin with names of outer members, `map.layers`; indices of lists do not count.
"""

import json
import sys
from pathlib import Path

RENAMES = {tuple(old.split(".")): new for old, new in json.loads(Path(__file__).with_name("renames.json").read_text()).items()}


def renamed(value, path=()):
    """`value` with the new names; `path` are the old names of the outer members."""
    if isinstance(value, dict):
        return {name_of(path + (k,)): renamed(v, path + (k,)) for k, v in value.items()}
    return [renamed(v, path) for v in value] if isinstance(value, list) else value


def name_of(path):
    matches = (new for old, new in RENAMES.items() if path[-len(old):] == old)
    return next(matches, path[-1])


def differences(old, new, path=""):
    if isinstance(old, dict) and isinstance(new, dict):
        for k in sorted(old.keys() | new.keys()):
            if k not in old or k not in new:
                yield f"{path}.{k}: only in the {'new' if k in new else 'old'} report"
            else:
                yield from differences(old[k], new[k], f"{path}.{k}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, (a, b) in enumerate(zip(old, new)):
            yield from differences(a, b, f"{path}[{i}]")
    elif old != new:
        yield f"{path}: {old} became {new}"


def main():
    old, new = (json.loads(Path(p).read_text()) for p in sys.argv[1:3])
    for report in (old, new):
        if isinstance(report, dict):
            report.pop("wall", None)
    found = list(differences(renamed(old), new))
    print("\n".join(found) or "equal after the renames")
    sys.exit(bool(found))


main()
