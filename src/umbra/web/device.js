// WebGL2: the context, programs with their uniforms, buffers and targets.

/** @typedef {{vertex: string, fragment: string}} Source */
/** @typedef {number | boolean | ArrayLike<number>} Value */

/** The browser or the machine has no WebGL2; show pictures instead. */
export class WebGLMissing extends Error {}

/** A context, and what it can do. */
export class Device {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    const gl = /** @type {WebGL2RenderingContext | null} */ (
      canvas.getContext("webgl2", {
        alpha: true,
        antialias: false,
        depth: false,
        stencil: false,
        premultipliedAlpha: true,
        powerPreference: "high-performance",
      })
    );
    if (!gl) {
      throw new WebGLMissing(
        "this browser gives no WebGL2 context; turn on hardware acceleration, " +
          "or use another browser",
      );
    }
    this.gl = gl;
    /** Depth from 1 at the near plane to 0 at infinity, in 32 bits: as fine far away as near. */
    this.reverses = false;
    /** @type {any} */
    const control = gl.getExtension("EXT_clip_control");
    if (control) {
      control.clipControlEXT(control.LOWER_LEFT_EXT, control.ZERO_TO_ONE_EXT);
      this.reverses = true;
    }
    /** Comparisons of depth by their meaning. */
    this.nearer = this.reverses ? gl.GREATER : gl.LESS;
    this.notFarther = this.reverses ? gl.GEQUAL : gl.LEQUAL;
    /** Pixels along an edge of what it draws into. */
    this.largest = Math.min(gl.getParameter(gl.MAX_RENDERBUFFER_SIZE), ...gl.getParameter(gl.MAX_VIEWPORT_DIMS));
    gl.clearDepth(this.reverses ? 0 : 1);
    /** @type {Map<Source, Program>} */
    this.programs = new Map();
  }

  /**
   * Draw into a rectangle as the middle of a wider viewport, which only the scissor ends.
   *
   * What leaves a viewport is cut there, and software rounds the cuts of two neighbours differently:
   * a crack. Such cuts are rarer the wider it is; by a power of two, places are the same to the bit.
   * @param {import('./canvas.js').Rectangle} rectangle
   * @returns {number} guard: how many times as wide and high the viewport is
   */
  setViewport([left, low, wide, high]) {
    const { gl } = this;
    const [most] = gl.getParameter(gl.MAX_VIEWPORT_DIMS);
    const guard = [4, 2].find((times) => times * Math.max(wide, high) <= most) ?? 1;
    const aside = (guard - 1) / 2;
    gl.viewport(left - aside * wide, low - aside * high, guard * wide, guard * high);
    return guard;
  }

  /** @param {Source} source */
  use(source) {
    let program = this.programs.get(source);
    if (!program) {
      program = new Program(this.gl, source);
      this.programs.set(source, program);
    }
    this.gl.useProgram(program.program);
    return program;
  }

  /**
   * Make a vertex array of attributes by name: buffer, numbers, type, stride and offset.
   * @param {Source} source whose attributes they are
   * @param {Record<string, [WebGLBuffer | null, number, number, number, number]>} attributes
   * @param {WebGLBuffer | null} indices
   */
  makeArray(source, attributes, indices) {
    const { gl } = this;
    const { program } = this.use(source);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [name, [buffer, size, type, stride, offset]] of Object.entries(attributes)) {
      const location = gl.getAttribLocation(program, name);
      if (location < 0) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, type, type !== gl.FLOAT, stride, offset);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bindVertexArray(null);
    return array;
  }

  /**
   * @param {BufferSource} data
   * @param {number} [target] by default vertices
   */
  makeBuffer(data, target = this.gl.ARRAY_BUFFER) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return buffer;
  }
}

/** A program, whose uniforms are set by name; unknown names are left out, as compilers do. */
class Program {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Source} source
   */
  constructor(gl, source) {
    const program = /** @type {WebGLProgram} */ (gl.createProgram());
    /** @type {[number, string][]} */
    const stages = [
      [gl.VERTEX_SHADER, source.vertex],
      [gl.FRAGMENT_SHADER, source.fragment],
    ];
    for (const [kind, text] of stages) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      gl.deleteShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
      }
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`a program does not link: ${gl.getProgramInfoLog(program)}`);
    }
    this.gl = gl;
    this.program = program;
    /** @type {Map<string, {location: WebGLUniformLocation | null, type: number}>} */
    this.uniforms = new Map();
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
    for (let i = 0; i < count; i++) {
      const info = gl.getActiveUniform(program, i);
      if (!info) continue;
      const location = gl.getUniformLocation(program, info.name);
      this.uniforms.set(info.name, { location, type: info.type });
    }
  }

  /** @param {Record<string, Value>} values */
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      const uniform = this.uniforms.get(name);
      if (!uniform) continue;
      const { location, type } = uniform;
      const list = /** @type {any} */ (value);
      if (type === gl.FLOAT) gl.uniform1f(location, list);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(location, list);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(location, list);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(location, list);
      else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(location, true, list);
      else gl.uniform1i(location, Number(value));
    }
    return this;
  }
}
