// One direction of the acoustic link as the page sees it: rates, loss, bits by class.

/** Energy of a bit on air: 8 W at 10 kbit/s. */
const JOULES_PER_BIT = 8 / 10_000;

export class Direction {
  constructor(seed) {
    this.seed = seed;
    this.turns = [];
    this.frames = 0;
    this.lost = 0;
    this.maxBps = 0;
    this.bytes = { map: 0, status: 0, directive: 0, fix: 0, exemplar: 0, overhead: 0 };
  }

  random() {
    this.seed = (Math.imul(this.seed, 1664525) + 1013904223) >>> 0;
    return this.seed / 4294967296;
  }

  /** Sends `parts` bytes by class in frames of 128 bytes; true if the turn got through. */
  send(nowS, parts, loss) {
    const bytes = Object.values(parts).reduce((a, b) => a + b, 0);
    const frames = Math.max(1, Math.ceil(bytes / 128));
    let lost = 0;
    for (let i = 0; i < frames; i += 1) lost += this.random() < loss ? 1 : 0;
    for (const [k, v] of Object.entries(parts)) this.bytes[k] += v;
    this.bytes.overhead += frames * 14;
    this.frames += frames;
    this.lost += lost;
    this.turns.push({ t: nowS, bits: (bytes + frames * 14) * 8, kept: 1 - lost / frames });
    this.turns = this.turns.filter((x) => x.t > nowS - 620);
    this.maxBps = Math.max(this.maxBps, this.sum(nowS, 10) / 10);
    return lost < frames || frames === 0;
  }

  sum(nowS, windowS) {
    return this.turns.filter((x) => x.t > nowS - windowS && x.t <= nowS).reduce((a, x) => a + x.bits, 0);
  }

  json(nowS) {
    const recent = this.turns.filter((x) => x.t > nowS - 60);
    const window = Math.max(1, Math.min(60, nowS));
    return {
      bps_1min: Math.round(recent.reduce((a, x) => a + x.bits, 0) / window),
      max_window_bps: Math.round(this.maxBps),
      loss: this.frames ? this.lost / this.frames : 0,
      frames: this.frames,
      lost: this.lost,
      goodput_bps: Math.round(recent.reduce((a, x) => a + x.bits * x.kept * 0.86, 0) / window),
      energy_j: Object.values(this.bytes).reduce((a, b) => a + b, 0) * 8 * JOULES_PER_BIT,
      bytes_by_class: { ...this.bytes },
    };
  }

  /** Bits on air per second in the ten seconds before `tS`. */
  rateAt(tS) {
    return Math.round(this.sum(tS, 10) / 10);
  }
}
