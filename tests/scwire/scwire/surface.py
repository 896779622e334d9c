"""A surface for one vehicle: python3 -m scwire.surface --listen 9600 --out DIR [options]

Sections 2 to 10: hello, statements, replica, orders (utility), turns, with or without a key. Left out: discovery,
more than one vehicle, fixes, content in force, full duplex, exemplars."""
import argparse, json, os, random, secrets, select, signal, socket, time, zlib
from collections import Counter
from . import cobs, frame, keys
from .bits import Short
from .replica import Replica

TURN_AROUND = 0.2


class Pair:
    def __init__(self, s, session, nonce):
        self.session, self.nonce = session, nonce
        self.replica = Replica()
        self.number = self.horizon = self.proofs = 0
        self.stated = 0     # the highest accepted frame with a statement
        self.flight = {}
        self.crypt = keys.Session(s.key, s.mission, s.address, s.nonce, nonce, s.encrypt) if s.key else None

    def judge(self, f, why):
        """3.4, of a frame whose result in the window is `why`; [(number, held)]"""
        if not f.ack:
            return []
        bits, low, lost = f.ack
        if bits != 12 and (why != 'ok' or f.number < self.stated):
            return []
        if why == 'ok':
            self.stated = max(self.stated, f.number)
        ahead = (low - self.horizon) % (1 << bits)
        if ahead == 0 or self.horizon + ahead > self.number:
            return []
        h = self.horizon + ahead
        out = [(n, h - n not in lost) for n in range(self.horizon + 1, h + 1)]
        self.horizon = h
        return out


class Slot:
    def __init__(self, number, version, payload):
        self.number, self.version, self.payload, self.state = number, version, payload, 'queued'

    def chunk(self):
        return frame.chunk(3, bytes([(self.number & 7) << 5 | self.number >> 3]) + self.version.to_bytes(2, 'big') + self.payload)


class Surface:
    def __init__(self, a):
        self.a, self.mission, self.address = a, a.mission, a.address
        self.scale, self.bit_rate, self.full = a.scale, a.bit_rate, a.frame_bytes
        self.key = keys.read(a.key, a.address) if a.key else None
        self.hello_key = keys.hello_key(self.key) if self.key else None
        self.encrypt = a.encrypt
        self.count, self.slots = Counter(), {}
        self.series = secrets.token_bytes(6)
        self.l = socket.socket()
        self.l.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.l.bind(('127.0.0.1', a.listen))
        self.l.listen(1)
        self.c, self.reader = None, None
        self.start = time.monotonic()
        self.late = []
        self.begin_run('start')

    def now(self):
        return (time.monotonic() - self.start) * self.scale

    def log(self, *w):
        print(f'{self.now():8.2f}', *w, flush=True)

    def begin_run(self, why):
        self.session, self.nonce = random.randrange(1, 65536), secrets.token_bytes(8)
        self.pair, self.offered, self.ended = None, {}, {}
        self.log('new run', hex(self.session), why)
        self.new_vehicle()

    def new_vehicle(self):
        for s in self.slots.values():
            if s.state in ('on air', 'received'):
                s.state = 'queued'

    # ---- modem
    def send(self, raw):
        self.count['sent'] += 1
        if self.c:
            try:
                self.c.sendall(cobs.encode(raw))
            except OSError:
                self.c = None
        self.wait(8 * len(raw) / self.bit_rate)

    def wait(self, seconds):
        end = self.now() + seconds
        while self.now() < end:
            self.poll(end)

    def poll(self, end):
        """Read until `end` at most; frames go to self.late."""
        r, _, _ = select.select([self.l] + ([self.c] if self.c else []), [], [], max(0, (end - self.now()) / self.scale))
        for x in r:
            if x is self.l:
                self.c, _ = self.l.accept()
                self.c.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self.reader = cobs.Reader()
                self.log('modem connected')
            else:
                try:
                    d = x.recv(65536)
                except OSError:
                    d = b''
                if not d:
                    self.c = None
                    self.log('modem gone')
                    continue
                for raw in self.reader.feed(d):
                    if raw is None:
                        self.count['cobs'] += 1
                    else:
                        got = self.receive(raw)
                        if got:
                            self.late.append(got)

    # ---- receive; the result matters to the turn: ('hello'|'frame'|'old', frame)
    def refuse(self, why):
        self.count['refused: ' + why] += 1

    def number_in(self, p, f, keyed):
        return frame.number_in(f, self.mission, self.session, p.session, p.replica.window.highest, p.crypt if keyed else None)

    def refusal(self, f, keyed):
        """2.5: why a numbered frame does not verify in an offered pair or the present one."""
        if f.K and not keyed:
            return 'keyed'
        if keyed and not f.K:
            fits = any(self.number_in(p, f, False) is not None for p in [self.pair, *[*self.offered.values()][-1:]] if p)
            return 'unauthenticated' if fits else 'checksum'
        for p in self.ended.values():
            n = self.number_in(p, f, keyed)
            if n is not None and (not keyed or n > p.replica.window.highest):
                return 'old session'
        return 'checksum'

    def receive(self, raw):
        try:
            f = frame.parse(raw)
            if f.dst != 0 or f.src == 0:
                return self.refuse('not for us')
            if f.src != self.address:
                return self.refuse('unknown sender')
        except Short as e:
            return self.refuse(str(e))
        if f.H:
            crc_ok = not f.K and frame.hello_crc(self.mission, self.session, f.unsealed) == f.seal
            if self.key:
                if not f.K or keys.hello_tag(self.hello_key, self.mission, self.session, self.nonce, f.unsealed) != f.seal:
                    return self.refuse('unauthenticated' if crc_ok else 'checksum')
            elif not crc_ok:
                return self.refuse('keyed' if f.K else 'checksum')
            return self.hello(f)
        keyed = bool(self.key) and self.a.authenticate == 'all'
        for p in [*self.offered.values(), self.pair]:
            f.number = self.number_in(p, f, keyed) if p else None
            if f.number is not None:
                break
        else:
            return self.refuse(self.refusal(f, keyed))
        before = p.replica.window.highest
        why = p.replica.take(f)
        if why not in ('ok', 'late', 'duplicate', 'no base'):     # no effect at all
            return self.refuse(why)
        if p is not self.pair:
            self.ended[self.pair.session] = self.pair
            self.pair, offers = p, [*self.offered.items()]
            self.offered = dict(offers[offers.index((p.session, p)) + 1:])
            self.log('the vehicle has taken run', hex(p.session))
            self.new_vehicle()
        for n, held in p.judge(f, why):
            self.count['down held' if held else 'down lost'] += 1
            for s, version in p.flight.pop(n, []):
                if held and s.version == version and s.state == 'on air':
                    s.state = 'received'
                    self.log(f'slot {s.number} version {s.version} received')
        if why != 'ok':
            self.refuse(why)
            if why == 'no base':
                self.begin_run(why)
            return None
        f.judged = p.horizon
        self.contact = self.now()
        for name, v in f.content:
            if name == 'report':
                from .status import SLOTS
                for s in self.slots.values():
                    got = v['slots'].get(SLOTS[s.number])
                    if got and got[0] == s.version & 255 and s.state == 'received':
                        s.state = got[1]
                        self.log(f'slot {SLOTS[s.number]} version {s.version}: {got[1]}')
                    elif s.state in ('received', 'applied') and not got and not getattr(s, 'told', False):
                        s.state = 'queued'
                    if got:
                        s.told = True
            if name in ('report', 'pose', 'details', 'introduction', 'content') and self.a.verbose:
                self.log(name, v)
        if p.replica.diverged:
            self.log('digest differs')
            self.begin_run('digest')
            return None
        return ('frame', f) if f.number > before else ('old', f)

    def hello(self, f):
        if f.ver != 4:
            self.log('vehicle of version', f.ver)
            return None
        try:
            intro = [p for k, p in frame.chunks(f.body) if k == 7 and p and p[0] == 0]
        except Short:
            intro = []
        if not intro or len(intro[0]) < 15:
            return self.refuse('malformed')
        if f.session in self.ended:
            return self.refuse('old session')
        if self.pair is None:
            self.pair = Pair(self, f.session, f.nonce)
            self.edge = int.from_bytes(intro[0][1:4], 'big') / 10000
            self.log('hello of the vehicle, run', hex(f.session), 'edge', self.edge)
            self.new_vehicle()
        elif f.session != self.pair.session and f.session not in self.offered:
            self.offered[f.session] = Pair(self, f.session, f.nonce)
            while len(self.offered) > 4:
                self.offered.pop(next(iter(self.offered)))
            self.log('the vehicle offers run', hex(f.session))
        return 'hello', f

    # ---- turns
    def stamp(self):
        return (int(self.now() * 1000) & 0xFFFFFF).to_bytes(3, 'big') + b'\xff\xff'

    def run(self):
        unanswered, pause, self.contact = 0, 0.0, -99
        full = 8 * self.full / self.bit_rate
        grant = self.a.grant
        while True:
            self.wait(TURN_AROUND + pause)
            pause, self.late = 0.0, []
            p, hello = self.pair, False
            loss = self.count['down lost'] / max(1, self.count['down lost'] + self.count['down held'])
            if p is None or unanswered >= 2 and unanswered % 2 == 0 or unanswered > 16:
                hello = True
                intro = frame.chunk(7, bytes(4) + self.series + b'\0' + int(time.time() // 3600).to_bytes(3, 'big') + b'\0')
                self.send(frame.write(0, self.address, self.session, 0, 1, 0, turn=grant, hello=True, body=intro, mission=self.mission,
                                      peer=0, key=self.hello_key, nonce=self.nonce))
                first = None
            else:
                if self.offered and unanswered % 2:
                    p = min(reversed(self.offered.values()), key=lambda q: q.proofs)
                    p.proofs += 1
                first = p.number + 1
                want = [s for s in self.slots.values() if s.state in ('queued', 'on air')] if p is self.pair else []
                copies = 2 if loss > 0.04 else 1
                for k in range(copies, 0, -1):
                    p.number += 1
                    body = b''.join(s.chunk() for s in want)
                    ack = p.replica.window.statement(self.full // 3)
                    size = 21 + len(body) + len(ack or b'')
                    raw = frame.write(0, self.address, self.session, p.number, p.number - p.horizon, min(255, (k - 1) * (8 * size // 32 + 1)),
                                      turn=grant, stamp=self.stamp() if self.full >= 48 else None, ack=ack, body=body, mission=self.mission,
                                      peer=p.session, key=p.crypt)
                    if want:
                        p.flight[p.number] = [(s, s.version) for s in want]
                    for s in want:
                        if s.state == 'queued':
                            self.log(f'slot {s.number} version {s.version} on air')
                        s.state = 'on air'
                    self.send(raw)
            end, answered, wait = self.now() + 0.5 + 2 * TURN_AROUND + 3 * full, False, None
            while self.now() < end:
                self.poll(end)
                for kind, f in self.late:
                    if kind == 'hello':
                        answered = answered or hello
                        end = self.now() + TURN_AROUND / 2
                        continue
                    if kind == 'frame' and (first is None or f.judged >= first):
                        answered = True
                    if f.remaining:
                        end = self.now() + f.remaining * full + TURN_AROUND + full / 2
                    elif kind == 'frame' and answered:
                        end = 0
                    if f.T and kind == 'frame':
                        pause = frame.quarters(f.turn) / 4
                self.late = []
            unanswered = 0 if answered else unanswered + 1
            if not answered:
                self.count['unanswered turns'] += 1
            pause = min(pause, 10.0)
            if any(s.state in ('queued', 'on air') for s in self.slots.values()) or not answered:
                pause = 0
            if self.tick():
                return

    def tick(self):
        """Orders and the end, between turns."""
        r = self.pair.replica if self.pair else None
        a = self.a
        if r and a.utility and 0 not in self.slots and len(set(r.map.shown.values())) >= a.after and 'report' in r.last:
            w = [int(x) for x in a.utility.split(',')]      # unseen, perplexity, label, weight, ...
            d = bytes([r.last['report']['epoch']]) + bytes(x & 255 for x in w)
            self.slots[0] = Slot(0, 1, d)
            self.log('order: utility', d.hex())
        if r and 'pose' in r.last and 'report' in r.last:
            ps = r.last['pose']
            if ps['mode'] == 'done' and ps['cells'] == len(r.map.shown) and not r.last['report']['backlog'] + r.last['report']['backlog_other']:
                self.idle = getattr(self, 'idle', None) or self.now()
                if self.now() - self.idle > a.drain:
                    return True
            else:
                self.idle = None
        return self.now() > a.seconds

    def save(self):
        os.makedirs(self.a.out, exist_ok=True)
        r = self.pair.replica
        write_png(self.a.out + '/map.png', r.map.shown)
        for i, d in r.known.items():
            write_png(f'{self.a.out}/{d["name"]}.png', r.layers[i].shown)
        with open(self.a.out + '/summary.json', 'w') as o:
            json.dump({'link': self.count, 'replica': r.count, 'last': {k: str(v) for k, v in r.last.items()},
                       'slots': {s.number: [s.version, s.state] for s in self.slots.values()}, 'cells': len(r.map.shown)}, o, indent=1)


def write_png(path, cells):
    from .compare import grid
    rows, w, h = grid(cells)
    part = lambda t, d: len(d).to_bytes(4, 'big') + t + d + zlib.crc32(t + d).to_bytes(4, 'big')
    with open(path, 'wb') as o:
        o.write(b'\x89PNG\r\n\x1a\n' + part(b'IHDR', w.to_bytes(4, 'big') + h.to_bytes(4, 'big') + bytes([8, 3, 0, 0, 0]))
                + part(b'PLTE', b''.join(bytes([i * 37 & 255, i * 91 & 255, i * 151 & 255]) for i in range(256)))
                + part(b'IDAT', zlib.compress(b''.join(b'\0' + bytes(r) for r in rows))) + part(b'IEND', b''))


def main():
    q = argparse.ArgumentParser()
    q.add_argument('--listen', type=int, required=True)
    q.add_argument('--out', required=True)
    q.add_argument('--mission', type=int, default=1)
    q.add_argument('--address', type=int, default=1)
    q.add_argument('--frame-bytes', type=int, default=256)
    q.add_argument('--bit-rate', type=float, default=10000)
    q.add_argument('--scale', type=float, default=1)
    q.add_argument('--grant', type=int, default=28, help='quarter seconds')
    q.add_argument('--key')
    q.add_argument('--authenticate', default='all')
    q.add_argument('--encrypt', action='store_true')
    q.add_argument('--utility', help='unseen,perplexity,label,weight,... in hundredths')
    q.add_argument('--after', type=int, default=3, help='order once the map has that many labels')
    q.add_argument('--seconds', type=float, default=900, help='of mission time')
    q.add_argument('--drain', type=float, default=30)
    q.add_argument('-v', '--verbose', action='store_true')
    for n in (signal.SIGINT, signal.SIGTERM):
        signal.signal(n, signal.default_int_handler)
    s = Surface(q.parse_args())
    try:
        s.run()
    except KeyboardInterrupt:
        pass
    s.log('link', dict(s.count))
    if s.pair:
        s.log('replica', dict(s.pair.replica.count))
        s.save()


main() if __name__ == '__main__' else None
