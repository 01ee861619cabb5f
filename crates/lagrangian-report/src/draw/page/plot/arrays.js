// Arrays of numbers as the page holds them (arrays.rs): a start and a step, or 24 bits a value in base64.

const GAP = 0xffffff;

export function unpacked({ length, from, step, low, high, bits }) {
  if (bits === undefined) return Float64Array.from({ length }, (_, k) => from + k * step);
  const letters = atob(bits), cell = new DataView(new ArrayBuffer(4));
  const word = (k) => (letters.charCodeAt(3 * k) << 16) | (letters.charCodeAt(3 * k + 1) << 8) | letters.charCodeAt(3 * k + 2);
  const floating = (word) => {
    cell.setUint32(0, (word << 8) >>> 0);
    return cell.getFloat32(0);
  };
  const value = low === undefined ? floating : (word) => (word === GAP ? NaN : low + (word / (GAP - 1)) * (high - low));
  return Float64Array.from({ length }, (_, k) => value(word(k)));
}
