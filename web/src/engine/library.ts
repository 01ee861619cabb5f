// Which build of the library this browser runs: that with relaxed SIMD, whose multiply-adds are one instruction, or that without.

import plain from "../../wasm/plain.wasm?url";
import relaxed from "../../wasm/relaxed.wasm?url";

/** A module whose one function is `f64x2.relaxed_madd` of its three parameters. */
const PROBE = new Uint8Array([
  ...[0x00, 0x61, 0x73, 0x6d, 0x01, 0x00, 0x00, 0x00],
  ...[0x01, 0x08, 0x01, 0x60, 0x03, 0x7b, 0x7b, 0x7b, 0x01, 0x7b], // (v128, v128, v128) -> v128
  ...[0x03, 0x02, 0x01, 0x00],
  ...[0x0a, 0x0d, 0x01, 0x0b, 0x00, 0x20, 0x00, 0x20, 0x01, 0x20, 0x02, 0xfd, 0x87, 0x02, 0x0b],
]);

const isRelaxed = WebAssembly.validate(PROBE);

/** Its name, as in the names of its files, and where it is. */
export const library = isRelaxed ? { name: "relaxed", url: relaxed } : { name: "plain", url: plain };
