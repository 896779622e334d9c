"""Holds a running surface against its own OpenAPI document: python check.py URL

Validates the document, calls every operation, validates each response against its schema, and parses the metrics as
Prometheus does.
"""

import json
import re
import sys
import urllib.error
import urllib.request

import jsonschema
import openapi_spec_validator
import prometheus_client.parser

URL = sys.argv[1].rstrip("/")
# Those that are missing here name a label of the map.
ORDERS = {
    "set_utility": {"weights": {}, "exploration": 0.1},
    "dry_run": {"weights": {}, "exploration": 0.1, "fence": {"fence": [[-200, -200], [200, -200], [200, 200]]}},
    "set_constraints": {"action": "resume"},
    "set_fence": {"fence": [[-500, -500], [500, -500], [500, 500], [-500, 500]], "keep_outs": [], "return_point": [0, 0]},
    "set_areas": {"areas": [{"outline": [[0, 0], [30, 0], [30, 20]], "weight": 0.5}]},
    "set_destination": {"place": [20, 10]},
    "set_limits": {"depth_m": [0, 500], "on_silence": "hold"},
    "set_settings": {"planner": "greedy", "gamma": 1e-5, "cells": "coarse-to-fine", "layers": "depth", "alpha": 0},
    "change_command": {"action": "take"},
    "keep_draft": {"weights": {"1": 0.5}, "exploration": 0.1},
    "add_note": {"text": "a wreck"},
    "add_marker": {"x_m": 12.5, "y_m": -3, "text": "a wreck"},
    "remove_marker": {"number": 1},
    "dismiss_earlier_map": {},
    "take_over_vehicle": {},
    "set_budget": {"budget_bps": 9000, "shares": {"directive": 10, "status": 5, "fix": 5, "map": 50, "exemplar": 20}},
}


# Those that are refused here: no order of the vehicle is withdrawn or lost, the surface is live, no record is kept, and this is
# no WebSocket.
REFUSED = {
    "give_order_again": (422, {"slot": "fence"}), "restore_orders": (422, {}), "replay": (404, {}), "replay_events": (404, None),
    "report": (422, None), "foxglove": (426, None)}


class NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_):
        return None


OPENER = urllib.request.build_opener(NoRedirect)


def ask(method, path, body=None, headers=None):
    """Status, headers and body."""
    given = {"x-scenecast": "1", "content-type": "application/json", **(headers or {})}
    request = urllib.request.Request(URL + path, method=method, data=body, headers=given)
    try:
        with OPENER.open(request, timeout=20) as answer:
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as e:
        return e.code, e.headers, e.read()


def expect(condition, what):
    if not condition:
        sys.exit(f"{URL}: {what}")


def validator(document, schema):
    whole = {**schema, "components": document["components"]}
    return jsonschema.Draft202012Validator(whole)


def strict(schema):
    """The schema with every object closed: a member that is not documented is an error here."""
    if isinstance(schema, dict):
        closed = {k: strict(v) for k, v in schema.items()}
        if "properties" in closed and "additionalProperties" not in closed:
            closed["additionalProperties"] = False
        return closed
    return [strict(v) for v in schema] if isinstance(schema, list) else schema


def validate(document, schema, value, what):
    error = jsonschema.exceptions.best_match(validator(document, schema).iter_errors(value))
    expect(error is None, f"{what} is not as documented: {error and error.json_path}: {error and error.message}")


def events(document, content, state_only):
    """Reads the stream until each kind of event was seen."""
    wanted = dict(content["x-events"])
    if state_only:
        wanted.pop("map")
    with OPENER.open(URL + "/api/v2/events", timeout=20) as stream:
        name = None
        for _ in range(1000):
            line = stream.readline().decode().rstrip("\n")
            if line.startswith("event: "):
                name = line[7:]
                expect(name in content["x-events"], f"event {name} is not documented")
            elif line.startswith("data: "):
                validate(document, content["x-events"][name], json.loads(line[6:]), f"event {name}")
                wanted.pop(name, None)
            if not wanted:
                return
    sys.exit(f"{URL}: no event {', '.join(wanted)} came")


def check_archived(document, path, schema_of_error):
    """Without an archived map, its files are refused as documented."""
    names = [m["name"] for m in json.loads(ask("GET", "/api/v2/archive")[2])["maps"]]
    if names:
        return path.replace("{name}", names[0])
    status, _, why = ask("GET", path.replace("{name}", "none"))
    expect(status == 404, f"{path} of no map: {status}")
    validate(document, schema_of_error, json.loads(why), f"the refusal of {path}")
    return None


def largest_label(vehicle):
    """The label of most cells now: a small one may have joined another since the state was read."""
    present = next(v for v in json.loads(ask("GET", "/api/v2/state")[2])["vehicles"] if v["id"] == vehicle)
    return max(present["labels"], key=lambda label: label["cells"])["id"]


def check(document, path, method, operation, state):
    vehicle = state["vehicles"][0]
    requested = path.replace("{id}", str(vehicle["id"])).replace("{x}", "0").replace("{y}", "-1")
    if "{name}" in path:
        requested = check_archived(document, path, {"$ref": "#/components/schemas/ErrorBody"})
        if requested is None:
            return
    if "{file}" in path:
        received = [l["id"] for l in vehicle["labels"] if l["exemplar"]["state"] == "received"]
        expect(received, "the surface has no image to read")
        requested = requested.replace("{file}", f"{received[0]}.webp")
    if path.endswith("/floor/{file}"):
        images = json.loads(ask("GET", f"/api/v2/vehicles/{vehicle['id']}/floor")[2])["images"]
        expect(images, "the surface has no image of the sea floor to read")
        requested = images[-1]["url"]
    name = operation["operationId"]
    good = next(status for status in operation["responses"] if status != "default")
    content = operation["responses"][good].get("content", {})
    if name == "events":
        return events(document, content["text/event-stream"], not vehicle["labels"])
    if name in REFUSED:
        expected, order = REFUSED[name]
        status, _, why = ask(method, requested, None if order is None else json.dumps(order).encode())
        expect(status == expected, f"{name}: {status} instead of {expected}: {why[:200]}")
        return validate(document, {"$ref": "#/components/schemas/ErrorBody"}, json.loads(why), f"the refusal of {name}")
    body, headers = None, None
    if name == "login":
        body, headers = b"token=any", {"content-type": "application/x-www-form-urlencoded"}
    elif "requestBody" in operation:
        order = ORDERS[name] if name in ORDERS else {"label": largest_label(vehicle["id"])}
        schema = operation["requestBody"]["content"]["application/json"]["schema"]
        validate(document, schema, order, f"the example of {name}")
        body = json.dumps(order).encode()
    status, got, answer = ask(method, requested, body, headers)
    expect(str(status) == good, f"{method} {requested}: {status} instead of {good}: {answer[:200]}")
    if content:
        kind, described = next(iter(content.items()))
        expect(got["content-type"] == kind, f"{requested} is {got['content-type']} instead of {kind}")
        if "schema" in described and kind.endswith("json"):
            validate(document, described["schema"], json.loads(answer), requested)
    if "{id}" in path:
        refused, _, why = ask(method, path.replace("{id}", "13").replace("{file}", "1.webp").replace("{x}", "0").replace("{y}", "0"), body, headers)
        expect(refused == 404, f"{method} {path} of no vehicle: {refused}")
        validate(document, {"$ref": "#/components/schemas/ErrorBody"}, json.loads(why), f"the refusal of {path}")
    allowed = {m for one in document["paths"][path] for m in ({"GET", "HEAD"} if one == "get" else {one.upper()})}
    for other in {"GET", "POST", "DELETE", "OPTIONS", "TRACE"} - allowed:
        status, got, why = ask(other, requested, b"{}")
        expect(status == 405, f"{other} {requested} is not documented but accepted: {status}")
        expect(set(got["allow"].split(",")) == allowed, f"{other} {requested}: Allow: {got['allow']} instead of {allowed}")
        validate(document, {"$ref": "#/components/schemas/ErrorBody"}, json.loads(why), f"the refusal of {other}")


def safety_orders(vehicle):
    """Fence, keep-outs, return point and each limit as last ordered, and the version of the last hold, resume or abort."""
    orders = next(v for v in json.loads(ask("GET", "/api/v2/state")[2])["vehicles"] if v["id"] == vehicle)
    versions = {s["slot"]: s["version"] for s in orders["directive"]["slots"]}
    parts = {**(orders["fence"] or {}), **(orders["limits"] or {})}
    return {**{k: v for k, v in parts.items() if v not in (None, [])}, "action": versions.get("constraints")}


def give_safety_orders(vehicle):
    """Orders a fence and limits, so that there is something that a body can remove."""
    for kind in ("fence", "limits"):
        status, _, why = ask("POST", f"/api/v2/vehicles/{vehicle}/{kind}", json.dumps(ORDERS[f"set_{kind}"]).encode())
        expect(status == 202, f"set_{kind}: {status}: {why[:200]}")


def fuzz(document, path, operation, vehicle):
    """Leaves out, nulls and empties each member of a body: no safety order changes that the body does not name."""
    name = operation["operationId"]
    schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
    if schema is None or name in ("take_over_vehicle", "change_command"):
        return 0
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
    given = {**ORDERS, **{refused: order for refused, (_, order) in REFUSED.items()}}
    order = given.get(name) or {"label": largest_label(vehicle)}
    requested, bodies = path.replace("{id}", str(vehicle)), [{}]
    for member in schema.get("properties", {}):
        bodies.append({k: v for k, v in order.items() if k != member})
        for value in (None, "", [], {}):
            bodies += [{**order, member: value}, {member: value}]
    for body in bodies:
        before = safety_orders(vehicle)
        status, _, why = ask("POST", requested, json.dumps(body).encode())
        expect(status < 500, f"{name} with {body}: {status}: {why[:200]}")
        after = safety_orders(vehicle)
        changed = {k for k in before.keys() | after.keys() if before.get(k) != after.get(k)}
        expect(status < 300 or not changed, f"{name} with {body} was refused and changed {changed}")
        allowed = set(body) if name in ("set_fence", "set_limits", "set_constraints") else set()
        why = {k: (before.get(k), after.get(k)) for k in changed - allowed}
        expect(not why, f"{name} with {body} changed {why}")
        if changed:
            give_safety_orders(vehicle)
    return len(bodies)


def check_metrics():
    figures = {f.name: f for f in prometheus_client.parser.text_string_to_metric_families(ask("GET", "/metrics")[2].decode())}
    expect(len(figures) > 20, f"only {len(figures)} figures")
    for f in figures.values():
        expect(f.documentation and f.type in ("counter", "gauge"), f"{f.name} has no HELP or TYPE")
        expect(re.fullmatch(r"scenecast_[a-z_]+", f.name), f"{f.name} is a strange name")
        for sample in f.samples:
            expect((f.type == "counter") == sample.name.endswith("_total"), f"{sample.name} is a {f.type}")
    classes = {s.labels["class"] for s in figures["scenecast_link_bits"].samples}
    expect(classes == set(json.loads(ask("GET", "/api/v2/state")[2])["link"]["up"]["bytes_by_class"]), f"classes {classes}")
    expect(any(s.value for s in figures["scenecast_link_bits"].samples), "no bit was counted")


def main():
    document = json.loads(ask("GET", "/api/openapi.json")[2])
    openapi_spec_validator.validate(document)
    document["components"]["schemas"] = strict(document["components"]["schemas"])
    state = json.loads(ask("GET", "/api/v2/state")[2])
    # The one who ran before, a terminal, has command: without a name we are another client.
    body = json.dumps({"weights": {}, "exploration": 0}).encode()
    status, _, why = ask("POST", f"/api/v2/vehicles/{state['vehicles'][0]['id']}/utility", body)
    expect(status == 409 and b"take command to move it here" in why, f"an order of another client: {status}: {why[:200]}")
    expect(ask("POST", "/api/v2/command", b'{"action": "take"}')[0] == 200, "command is not moved")
    wrong = ask("GET", "/api/v2/state", headers={"x-scenecast-client": "a b"})
    expect(wrong[0] == 400 and b"1 to 32 letters" in wrong[2], f"a wrong name of a client: {wrong[0]}")
    every = [(method, path, o) for path, methods in document["paths"].items() for method, o in methods.items()]
    # A request for a further image changes the state of the exemplar, so readings come first.
    for method, path, operation in sorted(every, key=lambda one: one[0]):
        check(document, path, method.upper(), operation, state)
    check_metrics()
    vehicle = state["vehicles"][0]["id"]
    give_safety_orders(vehicle)
    bodies = sum(fuzz(document, path, o, vehicle) for method, path, o in every if method == "post")
    print(f"{len(every)} operations are as documented; {bodies} changed bodies changed no safety order that they do not name")


main()
