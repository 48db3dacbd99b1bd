// Where pictures are drawn, and what of it a canvas keeps.

/** Where pictures are drawn: several samples a pixel, and what they resolve to. */
export class Target {
  /**
   * @param {Device} device
   * @param {number} columns
   * @param {number} rows
   * @param {number} samples
   * @param {number} format of colours
   */
  constructor({ gl }, columns, rows, samples, format) {
    this.gl = gl;
    this.columns = columns;
    this.rows = rows;
    this.format = format;
    const most = Math.max(0, ...gl.getInternalformatParameter(gl.RENDERBUFFER, format, gl.SAMPLES));
    this.askedSamples = samples;
    this.samples = samples > 1 ? Math.min(samples, most) : 0;
    const makeRenderbuffer = (/** @type {number} */ kind) => {
      const made = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, made);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, this.samples, kind, columns, rows);
      return made;
    };
    this.depth = makeRenderbuffer(gl.DEPTH32F_STENCIL8);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, columns, rows);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferRenderbuffer(
      gl.FRAMEBUFFER,
      gl.DEPTH_STENCIL_ATTACHMENT,
      gl.RENDERBUFFER,
      this.depth,
    );
    /** @type {WebGLRenderbuffer | null} */
    this.color = null;
    /** @type {WebGLFramebuffer | null} */
    this.resolved = null;
    if (this.samples) {
      this.color = makeRenderbuffer(format);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, this.color);
      this.resolved = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.resolved);
    }
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
  }

  /** Mean the samples of each pixel, in linear light. */
  resolve() {
    const { gl, columns, rows } = this;
    if (!this.resolved) return;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.frame);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.resolved);
    gl.blitFramebuffer(0, 0, columns, rows, 0, 0, columns, rows, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.invalidateFramebuffer(gl.READ_FRAMEBUFFER, [
      gl.COLOR_ATTACHMENT0,
      gl.DEPTH_STENCIL_ATTACHMENT,
    ]);
  }

  delete() {
    const { gl } = this;
    gl.deleteFramebuffer(this.frame);
    gl.deleteFramebuffer(this.resolved);
    gl.deleteRenderbuffer(this.depth);
    gl.deleteRenderbuffer(this.color);
    gl.deleteTexture(this.texture);
  }
}

/** The targets of a canvas: those of other numbers of samples are kept for when they are next. */
export class Targets {
  /** @param {Device} device */
  constructor(device) {
    this.device = device;
    /** @type {Target[]} */
    this.pool = [];
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {number} samples
   * @param {number} format
   */
  find({ width, height }, samples, format) {
    const isOld = (/** @type {Target} */ candidate) =>
      candidate.columns !== width || candidate.rows !== height || candidate.format !== format;
    for (const old of this.pool.filter(isOld)) old.delete();
    this.pool = this.pool.filter((candidate) => !isOld(candidate));
    let target = this.pool.find((candidate) => candidate.askedSamples === samples);
    if (!target) {
      target = new Target(this.device, width, height, samples, format);
      this.pool.push(target);
    }
    return target;
  }

  delete() {
    for (const target of this.pool) target.delete();
  }
}
