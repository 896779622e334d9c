"""An hour of a mission with all that real robots and cameras send, damaged and false values among it (issue 44).

usage: check.py PROGRAM [--minutes 10] [--scale 6] [--images 2] [--keep]

Runs `PROGRAM asv` and `PROGRAM auv` twice, with fence and limits in force:
* nmea: a GPS receiver, for so many minutes at `--scale` mission seconds a second: at the defaults an hour of the mission;
* images: a gpsd in its place and a folder of images, for half of that time at true speed, which live cameras need.
Each round must keep:
* the surface has a position, within 50 m of the true one, in 99 % of the polls after the first 30 s;
* the vehicle surveys: no limit and no fence was breached, since the vehicle never came near them, and every target is in the area;
* each port was opened once, and the autopilot did not restart;
* both ends log fewer than 200 lines for an hour of the mission, the lines of the start counted once.
Prints the figures, and a line for each promise that was broken; the exit code is then 1.

In both rounds an ArduSub is on the vehicle's link, with gimbal, companion, camera, ground station and the boat's autopilot. `inputs.py`
has what is sent, and which of it is damaged or false. Left out: a Doppler velocity log, which would be the navigation in place of the
autopilot, and bags, which are recordings. Needs pymavlink and pillow of tests/python/requirements.txt.
"""

import argparse
import collections
import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import inputs

CONFIG = Path(__file__).resolve().parents[2] / "config"
FENCE = [[-200, -200], [200, -200], [200, 200], [-200, 200], [-200, -200]]
START_S = 30
NEAR_M = 50
# The part of `--minutes` that the round with images has.
IMAGES_SHARE = 0.5
# What a log says where a link was lost, or the autopilot or the camera came anew.
RESTARTS = re.compile(r"opened again|set up again|has restarted|\bstalled|is lost|gives way|any more$")
# What it says where a port was opened, a connection was taken, or the autopilot was heard anew.
OPENED = re.compile(r"(\w+): (?:open|\S+ connected|the autopilot (answers))$")


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Mission:
    """Both ends of a mission as processes in a folder, with their logs."""

    def __init__(self, program, folder, scale, gps, autopilot, has_images):
        self.program, self.folder, self.ends = program, folder, {}
        self.console, modem = free_port(), free_port()
        surface = {"console.listen": f"127.0.0.1:{self.console}", "modem.listen": f"127.0.0.1:{modem}", "position.gps": gps}
        vehicle = {"modem.connect": f"127.0.0.1:{modem}", "autopilot.kind": "mavlink", "autopilot.port": f"udp:127.0.0.1:{autopilot}"}
        vehicle |= {"survey.start": "free", "survey.duration_s": 0}
        if has_images:
            (folder / "images").mkdir()
            vehicle |= {"camera.source": "watch:images", "camera.metres_per_pixel": inputs.Camera.METRES_PER_PIXEL}
        self.start("asv", surface | {"runtime.time_scale": scale})
        self.wait_for_surface()
        self.start("auv", vehicle | {"runtime.time_scale": scale})

    def start(self, end, settings):
        arguments = [self.program, "--progress", "none", end, "--config", CONFIG / f"{end}.toml"]
        for key, value in (settings | {"runtime.state_dir": f"state-{end}"}).items():
            arguments += ["--set", f"{key}={value}"]
        with open(self.log_file(end), "wb") as log:
            self.ends[end] = subprocess.Popen(
                arguments, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
            )

    def log_file(self, end):
        return self.folder / f"{end}.log"

    def log(self, end):
        return self.log_file(end).read_text(errors="replace").splitlines()

    def state(self):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.console}/api/v2/state", timeout=5) as answer:
            return json.load(answer)

    def wait_for_surface(self):
        until = time.monotonic() + 30
        while True:
            try:
                return self.state()
            except OSError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.2)

    def order(self, *words):
        url = f"http://127.0.0.1:{self.console}"
        subprocess.run([self.program, "ctl", "--url", url, *words], cwd=self.folder, check=True, stdout=subprocess.DEVNULL, timeout=60)

    def dead(self):
        return [end for end, process in self.ends.items() if process.poll() is not None]

    def stop(self):
        """The vehicle first, so that it does not miss the surface."""
        for process in reversed(self.ends.values()):
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


class Polls:
    """What the surface said in each poll after the start."""

    def __init__(self, craft, server):
        self.craft, self.server = craft, server
        self.count = self.valid = self.near = 0
        self.modes, self.state = collections.Counter(), {}

    def take(self, mission, counts):
        try:
            self.state = mission.state()
        except OSError:
            self.count += counts
            return
        status = self.state["vehicles"][0]["status"] or {}
        self.modes[status.get("mode"), status.get("reason")] += 1
        if counts:
            position = self.state["position"]
            self.count += 1
            self.valid += position["is_valid"]
            self.near += position["is_valid"] and self.is_near(position)

    def is_near(self, position):
        """By the globe, and by the map, whose origin is then one of the boat's first places."""
        off = self.craft.distance(self.server.now(), position["lat_deg"], position["lon_deg"])
        return off < NEAR_M and abs(position["x_m"]) < 200 and abs(position["y_m"]) < 200


class Logs:
    """The lines of both ends: those of the start, then those that go on."""

    def __init__(self, mission, started, seconds, scale):
        self.lines = {end: mission.log(end) for end in mission.ends}
        self.of_start = sum(started.values())
        self.later = sum(len(lines) for lines in self.lines.values()) - self.of_start
        self.hours = seconds * scale / 3600

    def per_hour(self):
        return self.of_start + self.later / self.hours

    def restarts(self):
        """Lines that speak of a restart, and ports that were opened more than once."""
        found = []
        for end, lines in self.lines.items():
            found += [f"{end}: {line}" for line in lines if RESTARTS.search(line)]
            opened = collections.Counter(match.groups() for line in lines if (match := OPENED.search(line)))
            found += [f"{end}: {port} has come {count} times" for (port, _), count in opened.items() if count > 1]
        return found

    def tells(self, text):
        return any(text in line for lines in self.lines.values() for line in lines)


class Round:
    """Both ends and what feeds them, for some minutes."""

    def __init__(self, name, program, scale, server, images):
        self.name, self.scale, self.server = name, scale, server
        self.folder = Path(tempfile.mkdtemp(prefix=f"scenecast-hour-{name}-"))
        autopilot = free_port(socket.SOCK_DGRAM)
        self.mission = Mission(program, self.folder, scale, server.address, autopilot, images > 0)
        self.sub = inputs.Sub(autopilot, scale)
        self.camera = inputs.Camera(self.folder / "images", self.sub, images) if images else None
        self.polls, self.logs, self.dead = Polls(inputs.Craft(), server), None, []

    def order(self):
        time.sleep(5)
        (self.folder / "fence.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [FENCE]}))
        self.mission.order("resume")
        self.mission.order("limits", "set", "--depth", "2..30", "--on-breach", "surface")
        self.mission.order("fence", "set", "--metres", "fence.geojson")

    def watch(self, minutes):
        began, started = time.monotonic(), {}
        while (seconds := time.monotonic() - began) < minutes * 60 and not self.mission.dead():
            if seconds >= START_S and not started:
                started = {end: len(self.mission.log(end)) for end in self.mission.ends}
            self.polls.take(self.mission, counts=seconds >= START_S)
            time.sleep(0.25)
        self.dead = self.mission.dead()
        self.logs = Logs(self.mission, started, max(seconds - START_S, 1), self.scale)

    def stop(self):
        for fed in (self.camera, self.sub):
            if fed:
                fed.stop()
        self.mission.stop()

    def run(self, minutes, keep):
        """Prints the figures and returns the broken promises."""
        try:
            self.order()
            self.watch(minutes)
        except (OSError, subprocess.SubprocessError) as e:
            self.dead = [f"{e}; ended: {self.mission.dead()}"]
        finally:
            self.stop()
        broken = [f"ended: {text}" for text in self.dead]
        if self.logs:
            broken += judge(self.polls, self.logs, self.server, self.camera)
            if self.sub.astray:
                broken.append(f"targets out of the area, north and east: {self.sub.astray}")
            self.print_figures()
        if broken or keep:
            print(f"{self.name}: logs are in {self.folder}", flush=True)
        else:
            shutil.rmtree(self.folder)
        return [f"{self.name}: {text}" for text in broken]

    def print_figures(self):
        polls, logs = self.polls, self.logs
        lengths = ", ".join(f"{end} {len(lines)}" for end, lines in logs.lines.items())
        print(f"{self.name}: position valid in {polls.valid}, right in {polls.near} of {polls.count} polls")
        print(f"{self.name}: modes {dict(polls.modes)}; {self.sub.targets} targets at the autopilot")
        print(f"{self.name}: lines {lengths} ({logs.of_start} in the first {START_S} s); {logs.per_hour():.0f} for an hour of the mission")
        print(f"{self.name}: of the GPS not used: {polls.state.get('position', {}).get('rejected')}")
        if self.camera:
            account = [line.split("camera: ", 1)[1] for line in self.mission.log("auv") if "images mapped" in line]
            print(f"{self.name}: images written: {self.camera.counts}; {account[-1] if account else 'no account of them'}")


def judge(polls, logs, server, camera):
    """A line for each broken promise."""
    broken = []
    for what, count in (("valid", polls.valid), (f"within {NEAR_M} m", polls.near)):
        if count < 0.99 * polls.count or not polls.count:
            broken.append(f"the position was {what} in {count} of {polls.count} polls")
    stops = {mode: count for mode, count in polls.modes.items() if mode[0] != "survey" and mode[1] not in (None, "order")}
    if stops:
        broken.append(f"false breaches: {stops}")
    if polls.modes["survey", None] < 0.9 * polls.modes.total():
        broken.append(f"the vehicle did not survey: {dict(polls.modes)}")
    broken += [f"a restart: {text}" for text in logs.restarts()]
    if server.connections > 1:
        broken.append(f"the surface connected to its receiver {server.connections} times")
    if logs.per_hour() >= 200:
        broken.append(f"{logs.per_hour():.0f} lines of log for an hour of the mission")
    shown = ["limits 1: Applied", "fence 1: Applied"] + ["camera: the first image has a pose"] * bool(camera)
    for text in shown:
        if not logs.tells(text):
            broken.append(f"the check is void, since no log says: {text}")
    return broken


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=lambda text: str(Path(text).resolve()), help="scenecast, built for release")
    parser.add_argument("--minutes", type=float, default=10, help="wall time of the round nmea (default 10)")
    parser.add_argument("--scale", type=float, default=6, help="mission seconds a second of the round nmea (default 6)")
    parser.add_argument("--images", type=float, default=2, help="images a second (default 2)")
    parser.add_argument("--keep", action="store_true", help="keep the folders of the rounds")
    options = parser.parse_args()
    minutes = options.minutes
    if minutes * 60 * IMAGES_SHARE < 2 * START_S:
        parser.error("--minutes must be 2 or more")
    nmea = inputs.Server("tcp", inputs.nmea, options.scale)
    broken = Round("nmea", options.program, options.scale, nmea, 0).run(minutes, options.keep)
    gpsd = inputs.Server("gpsd", inputs.gpsd, 1, inputs.GPSD_GREETING)
    broken += Round("images", options.program, 1, gpsd, options.images).run(minutes * IMAGES_SHARE, options.keep)
    print("\n".join(broken) or "all promises are kept")
    sys.exit(bool(broken))


if __name__ == "__main__":
    main()
