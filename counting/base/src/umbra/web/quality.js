// How finely to draw: while things move on a slow machine with fewer samples, then with fewer
// pixels, and finely at rest.

/** Samples a pixel and pixels along an edge, from a fine picture to the coarsest. */
export const LEVELS = [
  { samples: 4, scale: 1 },
  { samples: 1, scale: 1 },
  { samples: 1, scale: 0.75 },
  { samples: 1, scale: 0.5 },
];
const SLOW = [80, 200, 200]; // a frame of a level that takes longer gives way to the next [ms]
const MOVING = 1500; // frames that begin so soon after each other are a motion [ms]
const REST = 250; // after the last coarse frame all is drawn finely [ms]
const LOOK = 10; // between looks whether a frame is drawn [ms]

export class DrawQuality {
  /** @param {() => void} redraw */
  constructor(redraw) {
    this.redraw = redraw;
    this.last = -Infinity;
    this.timer = 0;
    this.looking = 0;
    /** what the last frame of each level took [ms] */
    this.costs = new Float64Array(LEVELS.length);
  }

  /**
   * The level of the frame that begins now.
   * @param {number} now [ms]
   */
  begin(now) {
    const isMoving = now - this.last < MOVING;
    this.last = now;
    clearTimeout(this.timer);
    let level = 0;
    while (isMoving && level < SLOW.length && this.costs[level] > SLOW[level]) level += 1;
    if (level) {
      this.timer = setTimeout(() => {
        this.last = -Infinity; // at rest
        this.redraw();
      }, REST);
    }
    return level;
  }

  /**
   * Find what a frame takes that has just been asked of the card.
   * @param {WebGL2RenderingContext} gl
   * @param {number} level
   * @param {number} begun [ms]
   */
  watch(gl, level, begun) {
    if (this.looking) return;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!fence) return;
    gl.flush();
    const look = () => {
      this.looking = 0;
      const status = gl.clientWaitSync(fence, 0, 0);
      if (status === gl.TIMEOUT_EXPIRED) {
        this.looking = setTimeout(look, LOOK);
      } else {
        this.costs[level] = performance.now() - begun;
        gl.deleteSync(fence);
      }
    };
    this.looking = setTimeout(look, LOOK);
  }

  stop() {
    clearTimeout(this.timer);
    clearTimeout(this.looking);
  }
}
