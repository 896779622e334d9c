"""Section 12: Ascon-AEAD128 (NIST SP 800-232) and what follows from the mission key."""
M = (1 << 64) - 1


def _perm(s, rounds):
    x0, x1, x2, x3, x4 = s
    for i in range(12 - rounds, 12):
        x2 ^= 0xF0 - i * 0x10 + i
        x0 ^= x4; x4 ^= x3; x2 ^= x1
        t0, t1, t2, t3, t4 = x0 ^ M & x0 ^ M, 0, 0, 0, 0
        t0 = x0 ^ (~x1 & x2); t1 = x1 ^ (~x2 & x3); t2 = x2 ^ (~x3 & x4); t3 = x3 ^ (~x4 & x0); t4 = x4 ^ (~x0 & x1)
        t1 ^= t0; t0 ^= t4; t3 ^= t2; t2 = ~t2 & M
        r = lambda v, n: (v >> n | v << 64 - n) & M
        t0 &= M; t1 &= M; t3 &= M; t4 &= M
        x0 = t0 ^ r(t0, 19) ^ r(t0, 28)
        x1 = t1 ^ r(t1, 61) ^ r(t1, 39)
        x2 = t2 ^ r(t2, 1) ^ r(t2, 6)
        x3 = t3 ^ r(t3, 10) ^ r(t3, 17)
        x4 = t4 ^ r(t4, 7) ^ r(t4, 41)
    return [x0, x1, x2, x3, x4]


def _aead(key, nonce, ad, text, decrypt=False):
    le = lambda b: int.from_bytes(b, 'little')
    k0, k1 = le(key[:8]), le(key[8:])
    s = _perm([0x00001000808c0001, k0, k1, le(nonce[:8]), le(nonce[8:])], 12)
    s[3] ^= k0; s[4] ^= k1
    if ad:
        a = ad + b'\1' + bytes(-(len(ad) + 1) % 16)
        for i in range(0, len(a), 16):
            s[0] ^= le(a[i:i + 8]); s[1] ^= le(a[i + 8:i + 16])
            s = _perm(s, 8)
    s[4] ^= 1 << 63
    out, n = b'', len(text)
    for i in range(0, n - 15, 16):
        b = (le(text[i:i + 8]), le(text[i + 8:i + 16]))
        c = (s[0] ^ b[0], s[1] ^ b[1])
        out += c[0].to_bytes(8, 'little') + c[1].to_bytes(8, 'little')
        s[0], s[1] = b if decrypt else c
        s = _perm(s, 8)
    rest = text[n - n % 16:]
    st = s[0].to_bytes(8, 'little') + s[1].to_bytes(8, 'little')
    o = bytes(x ^ y for x, y in zip(rest, st))
    out += o
    p = (o if decrypt else rest)
    st = bytes(x ^ y for x, y in zip(p + b'\1' + bytes(15 - len(p)), st))
    s[0], s[1] = le(st[:8]), le(st[8:])
    s[2] ^= k0; s[3] ^= k1
    s = _perm(s, 12)
    return out, (s[3] ^ k0).to_bytes(8, 'little') + (s[4] ^ k1).to_bytes(8, 'little')


def prf(key, nonce, data):
    return _aead(key, nonce, data, b'')[1]


def join(*parts):
    return b''.join(len(p).to_bytes(4, 'big') + p for p in parts)


def vehicle_key(m, address): return prf(m, b'scenecast-vehic1', bytes([address]))
def call_key(m): return prf(m, b'scenecast-calls1', b'')
def fingerprint(k): return prf(k, b'scenecast-print1', b'')[:4]
def hello_key(k): return prf(k, b'scenecast-hello1', b'')
def root(k): return prf(k, b'scenecast-sessn1', b'')


def vehicle_line(m, address):
    """The key file of a vehicle, 12.2."""
    k, c, f = vehicle_key(m, address), call_key(m), fingerprint(m)
    check = prf(k, b'scenecast-check1', join(bytes([address]), c, f))[:4]
    return f'scenecast-vehicle-key 2 {address} {k.hex()} {c.hex()} {f.hex()} {check.hex()}'


def offer(k, m, address, part):
    """A part of the next keys (of the mission key m) for a vehicle whose present key is k, 4.4."""
    head = bytes([part]) + fingerprint(m)
    mask = prf(k, b'scenecast-offer1', head)
    return head + bytes(a ^ b for a, b in zip(call_key(m) if part else vehicle_key(m, address), mask))


def read(path, address):
    """The key of a vehicle, from the key file of a mission or of that vehicle."""
    words = [l for l in open(path).read().split('\n') if l.strip() and not l.startswith('#')][0].split()
    return vehicle_key(bytes.fromhex(words[2]), address) if words[0] == 'scenecast-key' else bytes.fromhex(words[3])


def hello_tag(h, mission, session, nonce, frame):
    return prf(h, bytes(16), join(mission.to_bytes(4, 'big'), session.to_bytes(2, 'big'), nonce, frame))[:8]


def frame_nonce(direction, number):
    return bytes([direction]) + bytes(7) + number.to_bytes(8, 'big')


class Session:
    def __init__(self, k, mission, address, s, v, encrypt):
        self.e = encrypt
        self.key = prf(root(k), s + v, mission.to_bytes(4, 'big') + bytes([address, int(encrypt)]))

    def seal(self, direction, number, head, body):
        n = frame_nonce(direction, number)
        if self.e:
            c, t = _aead(self.key, n, head, body)
            return head + c + t[:8]
        return head + body + prf(self.key, n, join(head, body))[:8]

    def open(self, direction, number, head, body, tag):
        """The body, or None."""
        n = frame_nonce(direction, number)
        if self.e:
            p, t = _aead(self.key, n, head, body, True)
            return p if t[:8] == tag else None
        return body if prf(self.key, n, join(head, body))[:8] == tag else None
