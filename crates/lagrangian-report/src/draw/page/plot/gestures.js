  // Pointer, wheel and fingers: values under it, a box to zoom into, and views that move.

  const DRAG = 5; // px from which a press is a drag
  const LEAN = 24; // px of height from which a box zooms the ordinate of a sweep as well

  function within01(value) { return Math.min(Math.max(value, 0), 1); }

  function gestures(plot) {
    const { box } = plot, fingers = new Map();
    let drag = null, tap = null, tapped = -1e9; // a press of the mouse, one of a finger, and when the last one ended
    const spot = (event) => {
      const edge = box.getBoundingClientRect();
      return [event.clientX - edge.left, event.clientY - edge.top];
    };
    const part = ([px, py]) => [(px - plot.frame.left) / plot.frame.width, (plot.frame.bottom - py) / plot.frame.height];

    function pressed(event) {
      if (!plot.frame || event.button > 0) return;
      const at = spot(event);
      if (event.pointerType === "touch") {
        fingers.set(event.pointerId, at);
        tap = fingers.size === 1 ? at : null;
        point(plot, fingers.size === 1 ? cursorAt(plot, at) : null);
        return;
      }
      box.setPointerCapture(event.pointerId);
      drag = { from: at, last: at, pans: event.shiftKey, far: false };
    }

    function moved(event) {
      const at = spot(event);
      if (event.pointerType === "touch") fingerMoved(event, at);
      else if (drag) dragged(at);
      else point(plot, cursorAt(plot, at));
    }

    function dragged(at) {
      drag.far ||= Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) > DRAG;
      if (!drag.far) return;
      if (drag.pans) {
        plot.x.pan((drag.last[0] - at[0]) / plot.frame.width);
        plot.y.pan((at[1] - drag.last[1]) / plot.frame.height);
        drag.last = at;
        plot.changed(true);
        return;
      }
      point(plot, null);
      drag.last = at;
      drawBox();
    }

    // The corners of the box in parts of the frame; all the height where it is a stroke along the abscissa.
    function corners() {
      const [a, b] = [part(drag.from), part(drag.last)].map((corner) => corner.map(within01));
      const flat = plot.sweeps && Math.abs(drag.from[1] - drag.last[1]) < LEAN;
      const ends = (k) => [Math.min(a[k], b[k]), Math.max(a[k], b[k])];
      return { across: ends(0), up: flat ? [0, 1] : ends(1) };
    }

    function drawBox() {
      const { across, up } = corners(), { frame, marquee } = plot;
      marquee.hidden = false;
      marquee.style.left = `${frame.left + across[0] * frame.width}px`;
      marquee.style.top = `${frame.bottom - up[1] * frame.height}px`;
      marquee.style.width = `${(across[1] - across[0]) * frame.width}px`;
      marquee.style.height = `${(up[1] - up[0]) * frame.height}px`;
    }

    function released(event) {
      if (event.pointerType === "touch") {
        fingers.delete(event.pointerId);
        if (tap && event.type === "pointerup") tapEnded(event.timeStamp);
        return;
      }
      if (drag?.far && !drag.pans && event.type === "pointerup") zoomInto(corners());
      drag = null;
      plot.marquee.hidden = true;
    }

    // A second tap in short turn resets.
    function tapEnded(now) {
      const again = now - tapped < 320;
      tapped = again ? -1e9 : now;
      if (again) plot.reset();
    }

    function zoomInto({ across, up }) {
      const show = (axis, [low, high]) => {
        const at = (place) => axis.view[0] + place * (axis.view[1] - axis.view[0]);
        if (high - low > 0.004 && high - low < 1) axis.show(at(low), at(high));
      };
      show(plot.x, across);
      show(plot.y, up);
      plot.changed(true);
    }

    // One finger reads values, two move and stretch the view; a finger that goes up or down scrolls the page.
    function fingerMoved(event, at) {
      if (!fingers.has(event.pointerId)) return;
      const before = [...fingers.values()];
      fingers.set(event.pointerId, at);
      const now = [...fingers.values()];
      if (now.length === 1) {
        if (tap && Math.hypot(at[0] - tap[0], at[1] - tap[1]) > DRAG) tap = null;
        point(plot, cursorAt(plot, at));
      } else if (now.length === 2) {
        pinched(before, now);
      }
    }

    function pinched(before, now) {
      const middle = (pair) => [(pair[0][0] + pair[1][0]) / 2, (pair[0][1] + pair[1][1]) / 2];
      const apart = (pair) => Math.hypot(pair[0][0] - pair[1][0], pair[0][1] - pair[1][1]);
      const [from, to] = [middle(before), middle(now)], factor = apart(before) / Math.max(apart(now), 1);
      plot.x.pan((from[0] - to[0]) / plot.frame.width);
      if (!plot.sweeps) plot.y.pan((to[1] - from[1]) / plot.frame.height);
      zoomAt(plot, part(to), factor);
    }

    function turned(event) {
      if (!plot.frame || !(event.ctrlKey || document.activeElement === box)) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey) {
        plot.x.pan(((event.deltaX || event.deltaY) * lines) / plot.frame.width);
        plot.changed(true);
        return;
      }
      zoomAt(plot, part(spot(event)), Math.exp(Math.min(Math.max(event.deltaY * lines, -120), 120) * 0.0025));
    }

    box.addEventListener("pointerdown", pressed);
    box.addEventListener("pointermove", moved);
    box.addEventListener("pointerup", released);
    box.addEventListener("pointercancel", released);
    box.addEventListener("pointerleave", (event) => {
      if (!drag && event.pointerType !== "touch") point(plot, null);
    });
    box.addEventListener("dblclick", () => plot.reset());
    box.addEventListener("wheel", turned, { passive: false });
  }

  // Zooms around a place of the frame: a sweep along its abscissa, and along its ordinate where the pointer is beside it.
  function zoomAt(plot, [u, v], factor) {
    const beside = u < 0;
    if (!beside) plot.x.zoom(factor, within01(u));
    if (beside || !plot.sweeps) plot.y.zoom(factor, within01(v));
    plot.changed(true);
  }
