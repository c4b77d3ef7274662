/**
 * A seeded generator, so that a lab that draws random numbers does the same each time: xoshiro128** of Blackman and Vigna, its
 * state filled from the seed by splitmix32. It is 32-bit integer arithmetic, hence the same in every engine.
 */

const rotl = (x, k) => (x << k) | (x >>> (32 - k))

/**
 * @param {number} seed any finite number
 * @returns uniform numbers in [0, 1), multiples of 2^-53; `read` and `write` its state
 */
export function generator(seed) {
  const bits = new Uint32Array(new Float64Array([seed]).buffer)
  let z = (bits[0] ^ Math.imul(bits[1], 0x9e3779b1)) | 0
  const mix = () => {
    z = (z + 0x9e3779b9) | 0
    let x = Math.imul(z ^ (z >>> 16), 0x85ebca6b)
    x = Math.imul(x ^ (x >>> 13), 0xc2b2ae35)
    return x ^ (x >>> 16)
  }
  let [a, b, c, d] = [mix(), mix(), mix(), mix()]
  const next = () => {
    const result = Math.imul(rotl(Math.imul(b, 5), 7), 9)
    const t = b << 9
    c ^= a
    d ^= b
    b ^= c
    a ^= d
    c ^= t
    d = rotl(d, 11)
    return result >>> 0
  }
  const draw = () => ((next() >>> 5) * 67108864 + (next() >>> 6)) / 9007199254740992
  draw.read = () => [a, b, c, d]
  draw.write = (state) => void ([a, b, c, d] = state)
  return draw
}
