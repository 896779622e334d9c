"""Follow a recorded link from outside: python3 -m scwire.passive LOG [MISSION]. Writes nothing; see compare.py."""
import struct, sys, time
from collections import Counter
from . import cobs, frame, keys
from .bits import Short
from .replica import Replica


def records(path):
    d, p = open(path, 'rb').read(), 0
    while p + 12 <= len(d):
        t, direction, lost, n = struct.unpack_from('>dBBH', d, p)
        yield t, direction, lost, d[p + 12:p + 12 + n]
        p += 12 + n


class Follower:
    """Both directions of one pair of ends; with a key, `authenticate` = all. Calls need the key `calls`."""

    def __init__(self, mission, key=None, encrypt=False, address=1, calls=None):
        self.mission, self.count = mission, Counter()
        self.key, self.encrypt, self.address, self.calls_key = key, encrypt, address, calls
        self.nonces, self.crypts, self.top = {0: bytes(8)}, {}, Counter()
        self.surface, self.calls, self.pairs = [], [], []   # sessions of the surface; (surface's, vehicle's); newest last
        self.pair, self.replica = None, None
        self.dead = {}                                      # earlier pairs

    def hello_key(self, f):
        key = self.calls_key if f.dst == 15 else self.key
        return key and keys.hello_key(key)

    def hello_for(self, f, peer):
        if self.key:
            h = self.hello_key(f)
            return f.K and h and keys.hello_tag(h, self.mission, peer, self.nonces[peer], f.unsealed) == f.seal
        return not f.K and frame.hello_crc(self.mission, peer, f.unsealed) == f.seal

    def numbered_in(self, f, direction, pair):
        if self.key and pair not in self.crypts:
            self.crypts[pair] = keys.Session(self.key, self.mission, self.address, self.nonces[pair[0]], self.nonces[pair[1]], self.encrypt)
        sender, receiver = pair[direction], pair[1 - direction]
        f.number = frame.number_in(f, self.mission, receiver, sender, self.top[pair, direction], self.crypts.get(pair))
        if f.number is None:
            return False
        self.top[pair, direction] = max(f.number, self.top[pair, direction])
        return True

    def sent(self, f):
        if f.ack and self.pair == f.peer:
            w, (bits, low, _) = self.replica.window, f.ack
            w.closed = max(w.closed, w.base + (low - w.base) % (1 << bits))

    def take(self, direction, raw):
        try:
            f = frame.parse(raw)
        except Short as e:
            self.count[f'refused: {e}'] += 1
            return None
        if f.H:
            peers = [s for s in reversed(self.surface + self.calls if direction else [0]) if self.hello_for(f, s)]
        else:
            peers = (p for p in reversed(self.pairs) if self.numbered_in(f, direction, p))
        f.peer = peer = next(iter(peers), None)     # a session of the receiver, or a pair
        if peer is None:
            self.count['up' * direction + 'down' * (1 - direction) + ' does not verify'] += 1
            return None
        if f.H:
            self.nonces[f.session] = f.nonce
        self.count[('up' if direction else 'down') + (' hello' if f.H else ' numbered')] += 1
        if direction == 0:
            if f.H:
                where = self.calls if f.dst == 15 else self.surface
                if f.session not in where:
                    where.append(f.session)
            else:
                self.sent(f)
            try:
                f.chunks = frame.chunks(f.body)
                for k, p in f.chunks:
                    self.count[f'down chunk {k}' + (f'.{p[0]}' if k == 7 and p else '')] += 1
            except Short as e:
                self.count[f'down {e}'] += 1
            return f
        if f.H:
            if peer in self.surface and (peer, f.session) not in self.pairs:
                self.pairs.append((peer, f.session))
            return f
        if peer in self.dead:
            self.count['up old session'] += 1
            return None
        if self.pair != peer:
            if self.replica:
                self.dead[self.pair] = self.replica
            self.pair, self.replica = peer, Replica()
        f.result = self.replica.take(f)
        return f


def run(path, mission=1, verbose=False, key=None, encrypt=False):
    if isinstance(key, str):
        key = keys.read(key, 1)
    fo, t0, cost = Follower(mission, key, encrypt), None, time.time()
    for t, direction, lost, content in records(path):
        t0 = t0 or t
        raw = cobs.decode(content)
        if lost:
            fo.count['lost by the proxy'] += 1
            if direction:     # what the surface sent counts, lost or not
                continue
        if raw is None:
            fo.count['cobs'] += 1
            continue
        f = fo.take(direction, raw)
        if verbose and f:
            print(f'{t - t0:8.3f} {"up  " if direction else "down"} {len(raw):4} #{f.number} base {f.base}'
                  f' rem {f.remaining} turn {f.turn} ack {f.ack} {getattr(f, "result", "")}'
                  f' {[c[0] for c in getattr(f, "content", [])] if direction else [(k, p.hex()) for k, p in getattr(f, "chunks", [])]}')
    fo.seconds = time.time() - cost
    return fo


if __name__ == '__main__':
    fo = run(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1, '-v' in sys.argv)
    print('link   ', dict(fo.count))
    print('replica', dict(fo.replica.count))
    print('shown', len(fo.replica.map.shown), 'cells; layers', {fo.replica.known[i]['name']: len(m.shown) for i, m in fo.replica.layers.items()})
    print('last', fo.replica.last)
    print(f'{fo.seconds:.1f} s')
