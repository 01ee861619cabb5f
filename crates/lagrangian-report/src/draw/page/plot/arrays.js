  // Arrays of numbers as the page holds them (arrays.rs): a start and a step, or 24 bits a value in base64.

  const GAP = 0xffffff;

  function unpacked({ length, from, step, low, high, bits }) {
    if (bits === undefined) return Float64Array.from({ length }, (_, k) => from + k * step);
    const letters = atob(bits);
    const word = (k) => (letters.charCodeAt(3 * k) << 16) | (letters.charCodeAt(3 * k + 1) << 8) | letters.charCodeAt(3 * k + 2);
    const value = low === undefined ? floating : (word) => (word === GAP ? NaN : low + (word / (GAP - 1)) * (high - low));
    return Float64Array.from({ length }, (_, k) => value(word(k)));
  }

  // The upper 24 bits of a 32-bit float.
  const cell = new DataView(new ArrayBuffer(4));
  function floating(word) {
    cell.setUint32(0, (word << 8) >>> 0);
    return cell.getFloat32(0);
  }

  // Whether values never fall and none is missing: then a place on the abscissa has one value.
  function rises(x) {
    for (let k = 0; k < x.length; k++) if (!(k === 0 ? Number.isFinite(x[0]) : x[k] >= x[k - 1])) return false;
    return x.length > 1;
  }

  // The index of the value of a rising array that is nearest to `wanted`.
  function nearest(x, wanted) {
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x[middle] > wanted) high = middle; else low = middle;
    }
    return wanted - x[low] <= x[high] - wanted ? low : high;
  }

  // The least and the largest finite value of arrays.
  function span(arrays) {
    let low = Infinity, high = -Infinity;
    for (const values of arrays) {
      for (const value of values) {
        if (!Number.isFinite(value)) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return [low, high];
  }
