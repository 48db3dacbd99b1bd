// Where one looks from: infinitely far, at an azimuth of the plan and a tilt, level at 0.

const RADIANS = Math.PI / 180;

const makeCamera = () => {
  const camera = { azimuth: 215, tilt: 35, middle: [0, 0, 0], scale: 1, near: Infinity };  // scale: [pixels/m]
  const axes = () => {
    const a = camera.azimuth * RADIANS, t = camera.tilt * RADIANS;
    const toward = [Math.sin(a) * Math.cos(t), Math.cos(a) * Math.cos(t), Math.sin(t)];
    const right = [-Math.cos(a), Math.sin(a), 0];
    const up = [
      toward[1] * right[2] - toward[2] * right[1],
      toward[2] * right[0] - toward[0] * right[2],
      toward[0] * right[1] - toward[1] * right[0],
    ];
    return { toward, right, up };
  };
  const aim = (wide, high, times = 1) => {
    const { toward, right, up } = axes();
    const [mx, my, mz] = camera.middle, scale = camera.scale * times;
    const project = (x, y, z) => {
      const dx = x - mx, dy = y - my, dz = z - mz;
      return [
        wide / 2 + scale * (dx * right[0] + dy * right[1] + dz * right[2]),
        high / 2 - scale * (dx * up[0] + dy * up[1] + dz * up[2]),
        dx * toward[0] + dy * toward[1] + dz * toward[2],
      ];
    };
    return { toward, right, up, project, scale };
  };
  const frame = (box, wide, high, least = 0) => {
    // Let a box of the model, [low, high], fill most of the picture.
    const { right, up } = axes();
    camera.middle = [0, 1, 2].map((k) => (box[0][k] + box[1][k]) / 2);
    const span = (axis) => [0, 1, 2].reduce((sum, k) => sum + Math.abs(axis[k]) * (box[1][k] - box[0][k]), 0);
    camera.scale = 0.92 * Math.min(wide / Math.max(span(right), least, 1e-3), high / Math.max(span(up), least, 1e-3));
  };
  const turn = (azimuth, tilt) => {
    camera.azimuth = ((azimuth % 360) + 360) % 360;
    camera.tilt = Math.max(0, Math.min(90, tilt));
    camera.near = Infinity;
  };
  const pan = (dx, dy) => {
    const { right, up } = axes();
    camera.middle = camera.middle.map((v, k) => v - (dx * right[k] - dy * up[k]) / camera.scale);
  };
  const face = (normal) => {
    const flat = Math.hypot(normal[0], normal[1]);
    const azimuth = flat < 1e-6 ? camera.azimuth : Math.atan2(normal[0], normal[1]) / RADIANS;
    turn(azimuth, Math.atan2(normal[2], flat) / RADIANS);
  };
  return { camera, aim, frame, turn, pan, face };
};
