// Draws coloured points, lines and triangles with WebGL.

const VERTEX = `
attribute vec3 place;
attribute vec4 tint;
uniform mat4 matrix;
uniform float size;
varying vec4 colour;
void main() {
  gl_Position = matrix * vec4(place, 1.0);
  gl_PointSize = clamp(size / gl_Position.w, 1.5, 96.0);
  colour = tint;
}`;
const FRAGMENT = `
precision mediump float;
varying vec4 colour;
void main() { gl_FragColor = colour; }`;

export class Renderer {
  /** Throws when the browser has no WebGL. */
  constructor(canvas) {
    this.gl = canvas.getContext("webgl", { antialias: true });
    if (!this.gl) throw new Error("This browser offers no WebGL.");
    this.program = link(this.gl);
    this.matrix = this.gl.getUniformLocation(this.program, "matrix");
    this.size = this.gl.getUniformLocation(this.program, "size");
    this.shapes = new Map();
  }

  /** `places` three floats and `tints` four bytes a vertex; `mode` POINTS or LINES. */
  set(name, mode, places, tints) {
    const { gl } = this;
    const shape = this.shapes.get(name) ?? { places: gl.createBuffer(), tints: gl.createBuffer() };
    for (const [buffer, values] of [[shape.places, places], [shape.tints, tints]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    }
    this.shapes.set(name, { ...shape, mode: gl[mode], count: places.length / 3 });
  }

  draw(matrix, pointPixels, ground) {
    const { gl } = this;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(...ground.map((v) => v / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.matrix, false, matrix);
    gl.uniform1f(this.size, pointPixels);
    for (const shape of this.shapes.values()) {
      this.attribute("place", shape.places, 3, gl.FLOAT, false);
      this.attribute("tint", shape.tints, 4, gl.UNSIGNED_BYTE, true);
      gl.drawArrays(shape.mode, 0, shape.count);
    }
  }

  attribute(name, buffer, width, type, normalise) {
    const { gl } = this;
    const at = gl.getAttribLocation(this.program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, type, normalise, 0, 0);
  }
}

function link(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}
