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
    """Both directions of one pair of ends; with a key, `authenticate` = all."""

    def __init__(self, mission, key=None, encrypt=False, address=1):
        self.mission, self.count = mission, Counter()
        self.key, self.encrypt, self.address = key, encrypt, address
        self.hello_key = keys.hello_key(key) if key else None
        self.nonces, self.crypts, self.top = {0: bytes(8)}, {}, Counter()
        self.surface, self.vehicles, self.calls = [], [], []   # sessions, newest last
        self.pair, self.replica = None, None
        self.dead = []

    def verifies(self, f, direction, peer):
        if not f.K:
            return not self.key and frame.crc_of(self.mission, peer, f.unsealed, len(f.raw)) == f.seal
        if not self.key:
            return False
        if f.H:
            return keys.hello_tag(self.hello_key, self.mission, peer, self.nonces[peer], f.unsealed) == f.seal
        if f.session not in self.nonces:
            return False
        pair = (peer, f.session) if direction else (f.session, peer)
        if pair not in self.crypts:
            self.crypts[pair] = keys.Session(self.key, self.mission, self.address, self.nonces[pair[0]], self.nonces[pair[1]], self.encrypt)
        n = frame.nearest(f.number16, self.top[pair, direction])
        body = self.crypts[pair].open(direction, n, f.head, f.body, f.seal)
        if body is None:
            return False
        self.top[pair, direction] = max(n, self.top[pair, direction])
        f.body = body
        return True

    def sent(self, f):
        if f.ack and self.pair and self.pair[0] == f.session:
            h = frame.nearest(f.ack[0], self.replica.window.highest, 12)
            self.replica.window.closed = max(self.replica.window.closed, h)

    def take(self, direction, raw):
        try:
            f = frame.parse(raw)
        except Short as e:
            self.count[f'refused: {e}'] += 1
            return None
        peers = ([0] if f.H else self.vehicles) if direction == 0 else self.surface + self.calls
        for peer in reversed(peers):
            if self.verifies(f, direction, peer):
                break
        else:
            self.count['up' * direction + 'down' * (1 - direction) + ' does not verify'] += 1
            return None
        f.peer = peer
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
            if peer in self.surface and f.session not in self.vehicles:
                self.vehicles.append(f.session)
            return f
        if self.pair != (peer, f.session):
            if self.replica:
                self.dead.append(self.replica)
            self.pair, self.replica = (peer, f.session), Replica()
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
            if direction == 0 and raw:
                fo.sent(frame.parse(raw))     # a statement that the surface sent counts for its window, lost or not
            continue
        if raw is None:
            fo.count['cobs'] += 1
            continue
        f = fo.take(direction, raw)
        if verbose and f:
            print(f'{t - t0:8.3f} {"up  " if direction else "down"} {len(raw):4} #{getattr(f, "number", f.number16)} base {f.base}'
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
