// Drawing with the frames of the screen.

/** Calls `draw` with the next frame, once however often it is asked before. */
export function withNextFrame(draw: () => void): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      draw();
    });
  };
}
