// SPDX-License-Identifier: Apache-2.0
// The image: the sum of planes times their gains, shown. On the GPU, else here.

// Draws with WebGL2. Throws where there is none, or not enough of it.
class Gpu {
  constructor(canvas, width, height, planes, display) {
    const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error('no WebGL2');
    const largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (width > largest || height > largest || planes.length > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS))
      throw new Error('the image is larger than textures can be');
    this.gl = gl;
    this.width = width;
    this.height = height;
    this.count = planes.length;
    canvas.width = width;
    canvas.height = height;
    const program = this.program(display);
    gl.useProgram(program);
    this.uniform = name => gl.getUniformLocation(program, name);
    const bind = (unit, target, name) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, gl.createTexture());
      for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, side, gl.NEAREST);
      gl.uniform1i(this.uniform(name), unit);
    };
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
    bind(0, gl.TEXTURE_2D_ARRAY, 'planes');
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGB16F, width, height, planes.length);
    planes.forEach((plane, i) => {
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, i, width, height, 1, gl.RGB, gl.HALF_FLOAT, plane);
    });
    if (display.kind === 'lut') {
      const n = display.size;
      bind(1, gl.TEXTURE_3D, 'lut');
      gl.texStorage3D(gl.TEXTURE_3D, 1, gl.RGB16UI, n, n, n);
      gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, n, n, n, gl.RGB_INTEGER, gl.UNSIGNED_SHORT, display.table);
    }
    bind(2, gl.TEXTURE_2D, 'gains');
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, this.count, 2);
    gl.uniform1i(this.uniform('count'), this.count);
    gl.uniform1i(this.uniform('height'), height);
    if (gl.getError() !== gl.NO_ERROR) throw new Error('the GPU has not enough memory');
  }

  program(display) {
    const gl = this.gl;
    const vertex = `#version 300 es
      void main() { gl_Position = vec4(vec2[](vec2(-1, -1), vec2(3, -1), vec2(-1, 3))[gl_VertexID], 0, 1); }`;
    const fragment = `#version 300 es
      precision highp float;
      precision highp int;
      uniform highp sampler2DArray planes;
      uniform highp sampler2D gains;  // rows: those of the mix, those of the render
      uniform int count, height;
      uniform float wipe;  // pixels left of it are of the render
      out vec4 color;
      ${display.glsl()}
      void main() {
        ivec2 at = ivec2(gl_FragCoord.xy);
        int row = float(at.x) < wipe ? 1 : 0;
        at.y = height - 1 - at.y;
        vec3 sum = vec3(0);
        for (int i = 0; i < count; ++i) {
          vec3 gain = texelFetch(gains, ivec2(i, row), 0).rgb;
          if (gain != vec3(0)) sum += gain * texelFetch(planes, ivec3(at, i), 0).rgb;
        }
        color = vec4(floor(clamp(shown(sum), 0.0, 1.0) * 255.0 + 0.5) / 255.0, 1);
      }`;
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }

  draw(mix, render, wipe) {
    const gl = this.gl, rows = new Float32Array(8 * this.count);
    [mix, render].forEach((gains, row) => {
      for (let i = 0; i < this.count; ++i) {
        for (let k = 0; k < 3; ++k) rows[4 * (row * this.count + i) + k] = gains[3 * i + k];
      }
    });
    gl.activeTexture(gl.TEXTURE2);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, this.count, 2, gl.RGBA, gl.FLOAT, rows);
    gl.uniform1f(this.uniform('wipe'), wipe);
    gl.viewport(0, 0, this.width, this.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  get name() { return 'WebGL2'; }
}

// The sum of a pixel, in floats and in the order of the planes.
function pixelSum(planes, gains, pixel, sum) {
  sum.fill(0);
  for (let p = 0; p < planes.length; ++p) {
    for (let k = 0; k < 3; ++k) {
      const gain = gains[3 * p + k];
      if (gain !== 0) sum[k] += fround(gain * floatOfHalf[planes[p][3 * pixel + k]]);
    }
  }
}

// The same without a GPU: at first every third pixel, and all of them once nothing changes.
class Cpu {
  constructor(canvas, width, height, planes, display) {
    Object.assign(this, {width, height, planes, display});
    canvas.width = width;
    canvas.height = height;
    this.context = canvas.getContext('2d', {alpha: false});
    this.image = this.context.createImageData(width, height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.sums = new Float32Array(3 * width);
  }

  draw(mix, render, wipe, isMoving = false) {
    clearTimeout(this.timer);
    if (isMoving) {
      this.fill(mix, render, wipe, 3);
      this.timer = setTimeout(() => this.fill(mix, render, wipe, 1), 120);
    } else {
      this.fill(mix, render, wipe, 1);
    }
  }

  fill(mix, render, wipe, step) {
    const {width, height} = this;
    const border = Math.min(width, Math.max(0, Math.ceil(wipe)));
    for (let y = 0; y < height; y += step) {
      if (border > 0) this.row(render, y, 0, border, step);
      if (border < width) this.row(mix, y, border, width, step);
      const first = y * width;
      for (let k = 1; k < step && y + k < height; ++k) this.pixels.copyWithin(first + k * width, first, first + width);
    }
    this.context.putImageData(this.image, 0, 0);
  }

  row(gains, y, from, to, step) {
    const {sums, display, image, pixels} = this, first = y * this.width;
    sums.fill(0);
    for (let p = 0; p < this.planes.length; ++p) {
      const plane = this.planes[p], r = gains[3 * p], g = gains[3 * p + 1], b = gains[3 * p + 2];
      if (r === 0 && g === 0 && b === 0) continue;
      for (let x = from; x < to; x += step) {
        const i = 3 * x, at = 3 * (first + x);
        sums[i] += fround(r * floatOfHalf[plane[at]]);
        sums[i + 1] += fround(g * floatOfHalf[plane[at + 1]]);
        sums[i + 2] += fround(b * floatOfHalf[plane[at + 2]]);
      }
    }
    for (let x = from; x < to; x += step) {
      display.bytes(sums, 3 * x, image.data, 4 * (first + x));
      for (let k = 1; k < step && x + k < to; ++k) pixels[first + x + k] = pixels[first + x];
    }
  }

  get name() { return 'CPU'; }
}
