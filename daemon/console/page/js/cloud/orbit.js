// A camera that orbits a place on the sea floor.

import { lookAt, multiply, perspective } from "./matrix.js";

const FOV = Math.PI / 4;

export class Orbit {
  target = [0, 0, 0];
  distance = 40;
  azimuth = -0.5;
  elevation = 0.8;

  turn(dx, dy) {
    this.azimuth -= dx * 0.008;
    this.elevation = Math.min(1.55, Math.max(0.05, this.elevation + dy * 0.008));
  }

  /** Slides the target over the floor by screen pixels. */
  slide(dx, dy, height) {
    const metre = (2 * this.distance * Math.tan(FOV / 2)) / height;
    const [s, c] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    this.target[0] += metre * (-dx * c - dy * s);
    this.target[1] += metre * (-dx * s + dy * c);
  }

  zoom(factor) {
    this.distance = Math.min(100000, Math.max(1, this.distance / factor));
  }

  frame([west, south, east, north], z) {
    this.target = [(west + east) / 2, (south + north) / 2, z];
    this.distance = 1.5 * Math.max(4, east - west, north - south);
  }

  /** The matrix from world to clip space, and the pixels of one metre at distance 1. */
  matrix(width, height) {
    const flat = Math.cos(this.elevation) * this.distance;
    const eye = [
      this.target[0] + flat * Math.sin(this.azimuth),
      this.target[1] - flat * Math.cos(this.azimuth),
      this.target[2] + Math.sin(this.elevation) * this.distance,
    ];
    const view = lookAt(eye, this.target, [0, 0, 1]);
    const lens = perspective(FOV, width / height, this.distance / 100, this.distance * 20);
    return { matrix: multiply(lens, view), pixels: height / (2 * Math.tan(FOV / 2)) };
  }
}
