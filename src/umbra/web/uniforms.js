// The uniforms that all programs share in a view.

import { dot, subtract } from "./vectors.js";

/**
 * @param {Renderer} renderer
 * @param {Sight} sight
 * @param {number} guard of the viewport
 * @returns {Record<string, any>}
 */
export function findUniforms(renderer, sight, guard) {
  const high = sight.eye.map(Math.fround);
  const [a, b, c, d] = renderer.clip ?? [0, 0, 0, 1];
  const { overlay, style, size, ground } = renderer;
  const plan = overlay?.plan;
  const extent = plan?.extent ?? [0, 0, 0, 0];
  const above = ground === null ? 0 : Math.abs(sight.eye[2] - ground);
  const isEdgeOn = sight.isPerspective && !above;
  const corners = ground === null || isEdgeOn ? [] : sight.findGround(ground - sight.eye[2]);
  return {
    "corners[0]": corners.flat(),
    groundSize: corners.length,
    isSection: Boolean(renderer.clip),
    cutsInto: Boolean(renderer.clip) || sight.nearest <= sight.cameraNear, // the near plane may cut a solid
    guard,
    projection: sight.findMatrix(guard),
    eyeHigh: high,
    eyeLow: subtract(sight.eye, high),
    eye: sight.eye,
    forward: sight.forward,
    isPerspective: sight.isPerspective,
    cut: [a, b, c, dot([a, b, c], sight.eye) + d],
    height: (ground ?? 0) - sight.eye[2],
    // Parallel rays all come from one side, wherever they begin.
    facing: (sight.isPerspective ? (ground ?? 0) - sight.eye[2] : sight.forward[2]) < 0 ? 1 : -1,
    albedo: style.ground,
    horizon: style.horizon.map((c) => c / style.skylight), // times `share` where the ground ends
    haze: Math.max(8 * size, 25 * above),
    share: style.skylight,
    plan: plan
      ? [extent[0], extent[1], 1 / (extent[2] - extent[0]), 1 / (extent[3] - extent[1])]
      : [0, 0, 0, 0],
    opacity: overlay?.opacity ?? 1,
    isFlat: overlay?.shaded === false,
    overlay: 0,
  };
}
