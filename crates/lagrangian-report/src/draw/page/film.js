(() => {
  "use strict";
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  for (const card of document.querySelectorAll(".film")) {
    const own = JSON.parse(card.querySelector(".pictures").textContent);
    const films = own.pictures.map((text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
    const { width, height, colours } = own;
    const size = width * height * colours;
    const count = Math.min(...films.map((film) => Math.floor(film.length / size)));
    const canvases = [...card.querySelectorAll("canvas")];
    const button = card.querySelector(".play");
    const place = card.querySelector(".place");
    const clock = card.querySelector(".clock");
    place.max = count - 1;

    // The difference is grey where two pictures agree.
    function value(film, at) {
      return film < films.length ? films[film][at] : 128 + (films[1][at] - films[0][at]) / 2;
    }
    function draw(k) {
      canvases.forEach((canvas, film) => {
        const context = canvas.getContext("2d");
        const image = context.createImageData(width, height);
        for (let i = 0; i < width * height; i++) {
          for (let c = 0; c < 3; c++) image.data[4 * i + c] = value(film, k * size + i * colours + (colours === 3 ? c : 0));
          image.data[4 * i + 3] = 255;
        }
        context.putImageData(image, 0, 0);
      });
      place.value = k;
      clock.textContent = (k * own.step).toFixed(2) + " s";
    }

    let playing = false, begun = 0;
    function frame(now) {
      if (!playing) return;
      const k = Math.floor((now - begun) / 1000 / own.step) % count;
      draw(k);
      requestAnimationFrame(frame);
    }
    function set(on) {
      playing = on;
      button.textContent = on ? "Pause" : "Play";
      if (!on) return;
      begun = performance.now() - Number(place.value) * own.step * 1000;
      requestAnimationFrame(frame);
    }
    button.addEventListener("click", () => set(!playing));
    place.addEventListener("input", () => { set(false); draw(Number(place.value)); });
    draw(0);
    if (!calm) set(true);
  }
})();
