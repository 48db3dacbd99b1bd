// What part of a plan or view is seen: the whole, or a piece of it that is enlarged and moved.

const makeWindow = (canvas, cols, rows) => {
  const MOST = Math.max(8, Math.max(cols, rows) / 12);  // a dozen cells fill the picture
  const seen = { zoom: 1, x: cols / 2, y: rows / 2 };  // its middle in cells, y running down
  const lay = () => {
    // Where cells fall: device pixels per cell, and of the whole picture's left upper corner.
    const across = (canvas.width / cols) * seen.zoom, down = (canvas.height / rows) * seen.zoom;
    return { across, down, left: canvas.width / 2 - seen.x * across, top: canvas.height / 2 - seen.y * down };
  };
  const clamp = () => {
    const x = cols / seen.zoom / 2, y = rows / seen.zoom / 2;
    seen.x = Math.max(x, Math.min(cols - x, seen.x));
    seen.y = Math.max(y, Math.min(rows - y, seen.y));
    canvas.classList.toggle("zoomed", seen.zoom > 1);
  };
  const at = (event) => {
    // Of a pointer, the cell as a fraction.
    const box = canvas.getBoundingClientRect(), { across, down, left, top } = lay();
    return [
      (((event.clientX - box.left) / box.width) * canvas.width - left) / across,
      (((event.clientY - box.top) / box.height) * canvas.height - top) / down,
    ];
  };
  const zoom = (times, event = null) => {
    // What is under the pointer stays there.
    const [x, y] = event ? at(event) : [seen.x, seen.y];
    const was = seen.zoom;
    seen.zoom = Math.max(1, Math.min(MOST, was * times));
    seen.x = x + ((seen.x - x) * was) / seen.zoom;
    seen.y = y + ((seen.y - y) * was) / seen.zoom;
    clamp();
    return seen.zoom !== was;
  };
  const pan = (dx, dy) => {  // [CSS pixels]
    const dot = canvas.width / (canvas.clientWidth || canvas.width), { across, down } = lay();
    seen.x -= (dx * dot) / across;
    seen.y -= (dy * dot) / down;
    clamp();
  };
  const follow = (x, y) => {
    // Let a place be seen, a little from the rim.
    const w = (cols / seen.zoom / 2) * 0.9, h = (rows / seen.zoom / 2) * 0.9;
    seen.x = Math.max(x - w, Math.min(x + w, seen.x));
    seen.y = Math.max(y - h, Math.min(y + h, seen.y));
    clamp();
  };
  const center = (x, y) => { seen.x = x; seen.y = y; clamp(); };
  const show = ([left, top, right, bottom]) => {  // a box of cells, with room around it
    if (!(right > left)) return;
    seen.zoom = Math.max(1, Math.min(MOST, cols / (right - left) / 1.5, rows / (bottom - top) / 1.5));
    center((left + right) / 2, (top + bottom) / 2);
  };
  const whole = () => { seen.zoom = 1; clamp(); };

  const listen = (draw, tap) => {
    // A wheel turns the page, not the picture, unless the picture is in use: clicked, or with Ctrl.
    canvas.addEventListener("wheel", (event) => {
      const isAsked = event.ctrlKey || event.metaKey;
      if (!isAsked && document.activeElement !== canvas) return;
      const lines = event.deltaMode === 1 ? 16 : 1;
      if (!zoom(Math.exp(-event.deltaY * lines * (isAsked ? 0.004 : 0.0016)), event) && !isAsked) return;
      event.preventDefault();
      draw();
    }, { passive: false });
    const fingers = new Map();
    let dragged = 0, most = 0;
    const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY); };
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, { clientX: event.clientX, clientY: event.clientY });
      if (fingers.size === 1) dragged = most = 0;
      most = Math.max(most, fingers.size);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const was = fingers.get(event.pointerId);
      if (!was) return;
      const apart = fingers.size === 2 ? spread() : 0;
      const dx = event.clientX - was.clientX, dy = event.clientY - was.clientY;
      fingers.set(event.pointerId, { clientX: event.clientX, clientY: event.clientY });
      dragged += Math.hypot(dx, dy);
      if (fingers.size === 2) {
        const [a, b] = [...fingers.values()];
        pan(dx / 2, dy / 2);
        zoom(spread() / (apart || 1), { clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 });
      } else if (dragged >= 4 && seen.zoom > 1) pan(dx, dy);
      else return;
      draw();
    });
    const lift = (event) => {
      const wasDown = fingers.delete(event.pointerId);
      if (wasDown && event.type === "pointerup" && most === 1 && dragged < 4) tap(event);
    };
    canvas.addEventListener("pointerup", lift);
    canvas.addEventListener("pointercancel", lift);
    canvas.addEventListener("dblclick", (event) => { zoom(event.shiftKey ? 0.5 : 2, event); draw(); });
    for (const button of document.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", () => { press(button.dataset.zoom); draw(); });
    }
    return fingers;
  };
  const press = (key) => {
    // Tell whether a key or a button is one of those that zoom.
    if (key === "+" || key === "=") zoom(1.5);
    else if (key === "-") zoom(1 / 1.5);
    else if (key === "0") whole();
    else return false;
    return true;
  };
  return { seen, lay, at, zoom, follow, center, show, press, listen };
};
