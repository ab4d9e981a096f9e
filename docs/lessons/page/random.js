/* random.js: Python's random.Random, so that the room of lesson 4 gives the numbers of its notebook. */

const N = 624, M = 397;

export class Random {
  /** @param {number} seed a whole number below 2 ** 32 */
  constructor(seed) {
    const mt = this.mt = new Uint32Array(N), mixed = (i) => mt[i - 1] ^ mt[i - 1] >>> 30;
    mt[0] = 19650218;
    for (let i = 1; i < N; i++) mt[i] = Math.imul(1812433253, mixed(i)) + i;
    let i = 1;
    const next = () => { if (++i === N) [mt[0], i] = [mt[N - 1], 1]; };
    for (let k = 0; k < N; k++, next()) mt[i] = (mt[i] ^ Math.imul(mixed(i), 1664525)) + seed;
    for (let k = 1; k < N; k++, next()) mt[i] = (mt[i] ^ Math.imul(mixed(i), 1566083941)) - i;
    mt[0] = 0x80000000;
    this.at = N;
  }

  word() {
    const { mt } = this;
    if (this.at === N) {
      for (let k = 0; k < N; k++) {
        const y = mt[k] & 0x80000000 | mt[(k + 1) % N] & 0x7fffffff;
        mt[k] = mt[(k + M) % N] ^ y >>> 1 ^ (y & 1 ? 0x9908b0df : 0);
      }
      this.at = 0;
    }
    let y = mt[this.at++];
    y ^= y >>> 11;
    y ^= y << 7 & 0x9d2c5680;
    y ^= y << 15 & 0xefc60000;
    return (y ^ y >>> 18) >>> 0;
  }

  /** A number from 0 to 1, without 1. */
  number() { return ((this.word() >>> 5) * 67108864 + (this.word() >>> 6)) / 9007199254740992; }

  /** A whole number below n, as `randrange` and `choice` draw it. */
  below(n) {
    const unused = Math.clz32(n);
    for (;;) {
      const drawn = this.word() >>> unused;
      if (drawn < n) return drawn;
    }
  }
}
