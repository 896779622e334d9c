#!/usr/bin/env bash
# Builds the wheel, installs it in a new environment, and runs the tests and the notebook there, on two missions and a running surface.
# Usage: SCENECAST=program python/check.sh    (a loopback port from PORT, default 9490; packages from PyPI)
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
: "${SCENECAST:?path of the program}"
SCENECAST=$(realpath "$SCENECAST")
out=$(mktemp -d) port=${PORT:-9490} demo=
finish() {
    [ -z "$demo" ] || kill -INT "$demo" 2> /dev/null || true
    wait
    rm -rf "$out"
}
trap finish EXIT
export PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1

# The build leaves files beside its sources, and an import must find the installed package alone.
mkdir "$out/source"
cp -r "$here"/{README.md,pyproject.toml,scenecast} "$out/source"
cp -r "$here"/{tests,notebooks} "$out"
cd "$out"
python3 -m venv venv
venv/bin/pip wheel --quiet --no-deps --wheel-dir . ./source
venv/bin/pip install --quiet ./scenecast-*.whl

# A sea floor and images that take little computing, twice: the second mission has fewer labels and a slower link.
light=(--progress none --set world.kind=patches --set camera.width_px=320 --set camera.height_px=240)
"$SCENECAST" sim "${light[@]}" --duration 200 --out first > /dev/null
"$SCENECAST" sim "${light[@]}" --duration 200 --set link.budget_bps=1000 --set scene.max_labels=4 --out second > /dev/null
# The package needs nothing but what the wheel names.
venv/bin/python -c 'from scenecast import Mission; print(len(Mission.open("first").map()), "cells in a record")'

"$SCENECAST" demo "${light[@]}" --port "$port" --speed 8 --duration 100000 --set record.enabled=false > demo.log 2>&1 &
demo=$!
venv/bin/pip install --quiet "$(ls ./scenecast-*.whl)[test,notebook]"
export SCENECAST_RECORD=$out/first SCENECAST_SECOND_RECORD=$out/second SCENECAST_URL=http://127.0.0.1:$port SCENECAST_OUT=$out/exports
venv/bin/python - << 'P'
import os, time
from scenecast import SurfaceError, open_surface
for _ in range(120):
    try:
        surface = open_surface(os.environ["SCENECAST_URL"])
        if "confidence" in surface.map().layers and surface.exemplars():
            break
    except SurfaceError:
        pass
    time.sleep(1)
else:
    raise SystemExit("the demo has no confidence or no image after two minutes")
P
# A test that is skipped here would be none.
venv/bin/python -m pytest -q -p no:cacheprovider tests | tee tests.log
if grep -q skipped tests.log; then exit 1; fi
mkdir exports
venv/bin/jupyter nbconvert --log-level WARN --to notebook --execute --output-dir "$out" --output executed notebooks/first_look.ipynb
test -s exports/first.tif -a -s exports/second.tif -a -s exports/live.geojson
echo "the wheel, its tests and the notebook are fine"
