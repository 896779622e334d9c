#!/bin/bash
# An independent receiver and surface, written from WIRE.md alone, against the program: 0 when every map is equal cell for cell.
# Usage: SCENECAST=program PROJECT=checkout ./check.sh    (loopback ports from PORT, default 9470; about four minutes)
set -u
here=$(cd "$(dirname "$0")" && pwd); cd "$here"
: "${SCENECAST:?path of the program}" "${PROJECT:?checkout of the project}"
export SCENECAST_PRIOR="${SCENECAST_PRIOR:-$PROJECT/protocol/src/map_codec/context/prior.bin}" WIRE_MD="$PROJECT/protocol/WIRE.md" VECTORS="$PROJECT/protocol/vectors"
out=$(mktemp -d); port=${PORT:-9470}; bad=0
trap 'kill $(jobs -p) 2>/dev/null; rm -rf "$out"' EXIT
python3 -m scwire.golden || bad=1
"$SCENECAST" --progress none sim --duration 120 --record "$out/rec" --out "$out/sim" >/dev/null || exit 2
run() { # NAME LOSS KEYARGS [--set ...]
  local name=$1 loss=$2 keys=$3; shift 3; local d="$out/$name"; mkdir -p "$d"
  "$SCENECAST" --progress none asv --config "$PROJECT/config/asv.toml" --set modem.listen=127.0.0.1:$((port+1)) --set console.listen=127.0.0.1:$((port+2)) --set runtime.state_dir="$d/asv" --set runtime.time_scale=4 "$@" >"$d/asv.log" 2>&1 & local a=$!
  sleep 1; python3 proxy.py $port $((port+1)) "$d/log.bin" "$loss" 7 >"$d/proxy.log" 2>&1 & local x=$!
  sleep .5; "$SCENECAST" --progress none auv --config "$PROJECT/config/auv.toml" --set modem.connect=127.0.0.1:$port --set runtime.state_dir="$d/auv" --set runtime.time_scale=4 --set camera.source=frames:"$out/rec" "$@" >"$d/auv.log" 2>&1 & local v=$!
  sleep 45; kill -INT $v; sleep 1.5
  python3 - $((port+2)) "$d" <<'P'
import sys, urllib.request
for name in ("map.png", "map/tiles"):
    data = urllib.request.urlopen(f"http://127.0.0.1:{sys.argv[1]}/api/v2/vehicles/1/{name}").read()
    open(f"{sys.argv[2]}/{name.replace('map/tiles', 'tiles.bin')}", "wb").write(data)
P
  kill -INT $a; sleep 1; kill $x 2>/dev/null; wait $a $v $x 2>/dev/null; port=$((port+10))
  python3 -m scwire.compare "$d" $keys > "$d/compare.txt" 2>&1 || bad=1
  grep -E "differ" "$d/compare.txt" | grep -v " 0 pixels differ\| 0 differ" && bad=1
  grep -q "0 pixels differ" "$d/compare.txt" || { echo "$name: not compared"; tail -3 "$d/compare.txt"; bad=1; }
  grep "undecodable" "$d/compare.txt" && bad=1
  echo "$name: $(grep -c 'differ' "$d/compare.txt") comparisons"
}
"$SCENECAST" key new --out "$out/mission.key" >/dev/null
"$SCENECAST" key derive "$out/mission.key" --vehicle 1 --out "$out/auv-1.key" >/dev/null
run clean 0 ""
run lossy .2 "--key $out/auv-1.key --encrypt" --set link.key_file="$out/mission.key" --set link.encrypt=true
run png 0 "" --set map.codec=png
run small .2 "" --set link.frame_bytes=64
[ $bad = 0 ] && echo "the second implementation agrees" || echo "the second implementation differs"
exit $bad
