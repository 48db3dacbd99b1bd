// A town drawn by umbra's renderer: `draw` draws a frame, the sun moving.

const text = (id) => document.getElementById(id).textContent;
const data = JSON.parse(text("data"));
const packed = Uint8Array.from(atob(text("library")), (letter) => letter.charCodeAt(0));
const library = new TextDecoder().decode(packed);
const kit = new Function(`${library}\nreturn $kit;`)();
const model = await kit.unpackModel(kit.decode(data.block));
const canvas = document.getElementById("c"), [wide, high] = data.size;
canvas.style.width = `${wide}px`;
canvas.style.height = `${high}px`;
const renderer = new kit.Renderer(canvas, model, { pixelRatio: 1 });
const local = (place) => place.map((v, k) => v + data.origin[k] - model.origin[k]);
renderer.ground = local([0, 0, 0])[2];
renderer.camera = { eye: local(data.eye), target: local([0, 0, 0]), fov: 45, near: 1 };
globalThis.gl = renderer.device.gl;
let tick = 0;
globalThis.draw = (samples, scale) => {
  const turn = 0.6 + 0.004 * tick++;
  renderer.samples = samples;
  renderer.options.pixelRatio = scale;
  renderer.lights = [{ direction: [0.7 * Math.cos(turn), 0.7 * Math.sin(turn), 0.6] }];
  renderer.draw();
};
frames(1, 4, 1);
globalThis.ready = true;
