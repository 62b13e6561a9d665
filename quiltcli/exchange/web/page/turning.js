"use strict";
// What an eye sees of a spinning mirror from all around: pictures that were taken beforehand, one of which is shown.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("picture");
  const caption = document.getElementById("caption");
  const slider = document.getElementById("frame");
  const pen = canvas.getContext("2d");
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let place = 0; // views from the first one, a fraction
  let turn = 0; // which of the frames
  let alone = !still; // nobody has touched it yet
  let held = null;
  let before = 0;

  canvas.width = data.size[0];
  canvas.height = data.size[1];
  const pictures = data.turns.map((one) =>
    one.pictures.map((source) => {
      const image = new Image();
      image.onload = draw;
      image.src = source;
      return image;
    })
  );
  if (data.turns.length > 1) {
    document.getElementById("frames").hidden = false;
    slider.max = String(data.turns.length - 1);
    slider.addEventListener("input", () => {
      turn = Number(slider.value);
      draw();
    });
  }

  function draw() {
    const views = pictures[turn].length;
    const view = ((Math.round(place) % views) + views) % views;
    const image = pictures[turn][view];
    if (image.complete && image.naturalWidth) pen.drawImage(image, 0, 0);
    const degrees = ((360 * view) / views).toFixed(1).replace(/\.0$/, "");
    caption.textContent = `frame ${data.turns[turn].frame}, from ${degrees}°, ${data.where}`;
  }

  function walk(views) {
    place += views;
    draw();
  }

  function go(now) {
    if (alone) {
      walk(((now - before) / 1000 / data.seconds) * pictures[turn].length);
      before = now;
      requestAnimationFrame(go);
    }
  }

  canvas.addEventListener("pointerdown", (event) => {
    alone = false;
    held = event.clientX;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (held === null) return;
    // What is in front follows the hand, for azimuths grow to an eye's left; the width is half a way around.
    walk(((event.clientX - held) / canvas.clientWidth) * 0.5 * pictures[turn].length);
    held = event.clientX;
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, () => {
      held = null;
    });
  }
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: 1, ArrowRight: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    alone = false;
    place = Math.round(place);
    walk(step);
  });
  draw();
  if (alone) {
    before = performance.now();
    requestAnimationFrame(go);
  }
})();
