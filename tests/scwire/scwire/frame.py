"""Sections 2, 3.3 and 5: header, seal, ack statement, chunks; and the writers that a surface needs."""
from .bits import Short
from .crc import crc24, crc32c
from . import keys


class Frame:
    pass


def hello_crc(mission, receiver, unsealed):
    return crc24(mission.to_bytes(4, 'big') + receiver.to_bytes(2, 'big') + unsealed).to_bytes(3, 'big')


def numbered_crc(mission, receiver, sender, number, unsealed):
    d = mission.to_bytes(4, 'big') + b''.join((v & 0xFFFF).to_bytes(2, 'big') for v in (receiver, sender, number))
    return crc32c(d + unsealed).to_bytes(4, 'big')


def number_in(f, mission, receiver, sender, highest, crypt=None):
    """2.2: the number of a numbered frame between these runs, or None if it does not verify. With a tag, the body is plain then."""
    if f.K != (crypt is not None):
        return None
    n = nearest(f.low, highest, f.bits)
    if crypt:
        body = crypt.open(f.src != 0, n, f.head, f.body, f.seal)
        if body is None:
            return None
        f.body = body
        return n
    more = (nearest(high << 8 | f.low, highest) for high in range(256 if f.bits == 8 else 0))
    return next((n for n in (n, *more) if numbered_crc(mission, receiver, sender, n, f.unsealed) == f.seal), None)


def parse(raw):
    """Fields of a frame (checks 1 to 3 of 2.5). The seal is not verified."""
    f = Frame()
    f.raw = raw
    b0 = raw[0]
    f.ver, f.A, f.T, f.H, f.S, f.K = b0 >> 5, b0 >> 4 & 1, b0 >> 3 & 1, b0 >> 2 & 1, b0 >> 1 & 1, b0 & 1
    n = 8 if f.K else 3 if f.H else 4
    if len(raw) <= n:
        raise Short('truncated')
    f.unsealed, f.seal = raw[:-n], raw[-n:]
    if f.ver < (2 if f.H else 4):     # the first bit of a numbered frame is 1
        raise Short('version')
    d, p = f.unsealed, 1

    def take(k):
        nonlocal p
        if p + k > len(d):
            raise Short('truncated')
        p += k
        return d[p - k:p]
    a = take(1)[0]
    if f.H:
        f.src, f.dst = a >> 4, a & 15
        f.session = int.from_bytes(take(2), 'big')
        f.number = f.base = 0
        if f.session == 0:
            raise Short('malformed')
        take(3)     # not read
        f.remaining = take(1)[0]
    else:
        vehicle, more, near, f.bits = a & 15, a >> 4 & 7, f.ver & 3, 8
        f.src, f.dst = (vehicle, 0) if a & 0x80 else (0, vehicle)
        f.base, least = near or take(1)[0], 1 if near else 4
        if f.base & 0x80:
            f.base, f.bits, least = (f.base & 0x7F) << 8 | take(1)[0], 16, 128
        if not 1 <= vehicle <= 14 or not least <= f.base <= 2048:
            raise Short('malformed')
        f.low = int.from_bytes(take(f.bits // 8), 'big')
        f.remaining = more if more < 7 else take(1)[0]
    f.turn, f.ack = take(1)[0] if f.T else None, None
    if f.T and f.src and not f.H:
        short, low, f.turn = f.turn >> 7, f.turn >> 5 & 3, f.turn & 31     # the wish
        if short and f.A or low and not short:
            raise Short('malformed')
        if short:
            f.ack = 2, low, []
    f.stamp = take(5 if f.src == 0 else 6) if f.S else None
    f.nonce = take(8) if f.H and f.K else bytes(8)
    if f.A:
        f.ack = read_statement(take)
    f.head, f.body = d[:p], d[p:]
    return f


def quarters(wish):
    """2.1: quarter seconds."""
    return wish if wish < 8 else 4 + (wish & 3) << (wish >> 2) - 1


def read_statement(take):
    """Bits of the horizon, 4 if near and 12 if far; the horizon's low bits; distances. take(k) is the next k bytes."""
    b = take(1)[0]
    if b < 0x80:
        return 4, b >> 3, [d for d in (1, 2, 3) if b >> 3 - d & 1]
    h = (b & 0x7F) << 8 | take(1)[0]
    n = h & 7
    if n == 7:
        n = take(1)[0]
    return 12, h >> 3, losses(take(n))


def losses(code):
    """Distances from the horizon of the lost frames."""
    if not code:
        return []
    bits = ''.join(f'{b:08b}' for b in code)
    if bits[0] == '0':
        return [i for i, b in enumerate(bits[1:]) if b == '1']
    out, p, at = [], 1, 0
    while True:
        z = bits.find('0', p)
        if z < 0 or z + 3 >= len(bits):
            return out
        v = (z - p) << 3 | int(bits[z + 1:z + 4], 2)
        p = z + 4
        at += v
        if at >= 4096:
            return out
        out.append(at)
        at += 1


def loss_code(lost):
    """The shorter code of distances (ascending)."""
    if not lost:
        return b''
    best = '0' + ''.join('1' if i in set(lost) else '0' for i in range(lost[-1] + 1))
    best += '0' * (-len(best) % 8)
    s, at = '1', 0
    for x in lost:
        v = x - at
        s += '1' * (v >> 3) + '0' + f'{v & 7:03b}'
        at = x + 1
    s += '1' * (-len(s) % 8)
    if len(s) < len(best):
        best = s
    return int(best, 2).to_bytes(len(best) // 8, 'big')


def statement(bits, horizon, lost):
    """bits: 4, near, or 12, far. lost: distances, ascending; near, only 1 to 3."""
    if bits == 4:
        return bytes([(horizon & 15) << 3 | sum(8 >> d for d in lost)])
    c = loss_code(lost)
    n = len(c)
    return (0x8000 | (horizon & 4095) << 3 | min(n, 7)).to_bytes(2, 'big') + (bytes([n]) if n >= 7 else b'') + c


def chunks(body):
    out, p = [], 0
    while p < len(body):
        kind, n = body[p] >> 5, body[p] & 31
        if kind == 0:
            break
        p += 1
        if n == 31:
            n = len(body) - p
        elif n >= 27:
            if p >= len(body):
                raise Short('malformed')
            n = 27 + 256 * (n - 27) + body[p]
            p += 1
        if p + n > len(body):
            raise Short('malformed')
        out.append((kind, body[p:p + n]))
        p += n
    return out


def chunk(kind, payload):
    n = len(payload)
    if n <= 26:
        return bytes([kind << 5 | n]) + payload
    return bytes([kind << 5 | 27 + (n - 27 >> 8), n - 27 & 255]) + payload


def write_base(b):
    """The bytes of a base; 1 to 3 is in `near`."""
    return b'' if b < 4 else bytes([b]) if b < 128 else bytes([0x80 | b >> 8, b & 255])


def nearest(low, high, bits=16):
    """The number with these low bits that is nearest to `high`; the low bits themselves if that is below 0."""
    m = 1 << bits
    n = high - m // 2 + (low - (high - m // 2)) % m
    return n if n >= 0 else low


def write(src, dst, session, number, base, remaining, *, turn=None, stamp=None, ack=None, body=b'', hello=False,
          mission, peer, peer_nonce=bytes(8), key=None, nonce=None, ver=4):
    """key: a hello key or a keys.Session, or None. number and base are of a numbered frame."""
    first = ver if hello else 4 | (base if base < 4 else 0)
    b0 = first << 5 | (ack is not None) << 4 | (turn is not None) << 3 | hello << 2 | (stamp is not None) << 1 | (key is not None)
    if hello:
        h = bytes([b0, src << 4 | dst]) + session.to_bytes(2, 'big') + bytes([0, 0, 1, remaining])
    else:
        n = 1 if base < 128 else 2
        h = bytes([b0, (src != 0) << 7 | min(remaining, 7) << 4 | src | dst]) + write_base(base)
        h += (number & (1 << 8 * n) - 1).to_bytes(n, 'big') + (bytes([remaining]) if remaining >= 7 else b'')
    if turn is not None:
        h += bytes([turn])
    h += stamp or b''
    if hello and key is not None:
        h += nonce
    h += ack or b''
    if key is None:
        d = h + body
        return d + (hello_crc(mission, peer, d) if hello else numbered_crc(mission, peer, session, number, d))
    if hello:
        return h + body + keys.hello_tag(key, mission, peer, peer_nonce, h + body)
    return key.seal(0 if src == 0 else 1, number, h, body)
