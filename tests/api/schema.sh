#!/bin/bash
# Random requests made from the surface's own OpenAPI document, by schemathesis: 0 when each answer is as documented.
# Usage: [SCENECAST=program] [MINUTES=3] [SEED=1] tests/api/schema.sh    (a reproducible order of requests; loopback only)
set -euo pipefail
cd "$(dirname "$0")/../.."
version=4.32.5
program=$(realpath "${SCENECAST:-${CARGO_TARGET_DIR:-target}/release/scenecast}")
mkdir -p "${CARGO_TARGET_DIR:-target}"
place=$(realpath "${CARGO_TARGET_DIR:-target}")/schemathesis
if [ "$(cat "$place/version" 2> /dev/null)" != "$version" ]; then
    rm -rf "$place"
    python3 -m venv "$place"
    "$place/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: "schemathesis==$version"
    echo "$version" > "$place/version"
fi
out=$(mktemp -d)
demo=
trap '[ -z "$demo" ] || kill -INT "$demo" 2> /dev/null || true; wait; rm -rf "$out"' EXIT
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
"$program" --progress none demo --port "$port" --speed 5 --duration 30000 --set world.kind=patches \
    --set camera.width_px=320 --set camera.height_px=240 > "$out/demo.log" 2>&1 & demo=$!
# A request of the documented form may still be refused for what it means, such as a fence that crosses itself: 422.
# The status 400, which is for what is no request at all, is then a finding, and so is any of 500 to 599.
cat > "$out/schemathesis.toml" << 'TOML'
[checks]
positive_data_acceptance.expected-statuses = ["2xx", "3xx", "401", "403", "404", "409", "422", "429"]
TOML
# It keeps files of its own in the folder that it runs in.
cd "$out"
# The stream of events never ends. One name of a client for all requests, so that most of them have command.
code=0
"$place/bin/schemathesis" --config-file "$out/schemathesis.toml" run "http://127.0.0.1:$port/api/openapi.json" \
    --wait-for-schema 60 --checks all --exclude-path /api/v2/events --exclude-path /foxglove --phases examples,coverage,fuzzing,stateful \
    -H 'X-Scenecast: 1' -H 'X-Scenecast-Client: schema' --seed "${SEED:-1}" --max-time $((${MINUTES:-3} * 60)) \
    --request-timeout 20 --continue-on-failure --generation-database none --no-color || code=$?
kill -0 "$demo" 2> /dev/null || { cat "$out/demo.log"; echo "the demo has ended"; exit 1; }
exit "$code"
