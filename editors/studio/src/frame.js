// The frame of the map: from metres to pixels and back, moved and zoomed.
import { pleasant } from "./drag_edits.js";

const MARGIN = 34;

export class Frame {
  constructor() {
    this.scale = 1;
    this.left = 0;
    this.top = 0;
    this.fitted = true;
  }

  // The whole world in so many pixels.
  fit({ low, high }, width, height) {
    const [across, up] = [high[0] - low[0], high[1] - low[1]];
    this.scale = Math.max(1e-9, Math.min((width - 2 * MARGIN) / across, (height - 2 * MARGIN) / up));
    this.left = width / 2 - ((low[0] + high[0]) / 2) * this.scale;
    this.top = height / 2 + ((low[1] + high[1]) / 2) * this.scale;
    this.fitted = true;
  }

  x = (metres) => this.left + metres * this.scale;
  y = (metres) => this.top - metres * this.scale;
  metres = (pixels) => pixels / this.scale;

  // Zoom, and leave a point of the screen where it is.
  zoom(times, x, y) {
    this.left = x + (this.left - x) * times;
    this.top = y + (this.top - y) * times;
    this.scale *= times;
    this.fitted = false;
  }

  pan(across, down) {
    this.left += across;
    this.top += down;
    this.fitted = false;
  }

  // Metres that a drag goes by: a few pixels; finer where that is asked for.
  grid = (fine) => pleasant(this.metres(6)) / (fine ? 10 : 1);
  lines = () => pleasant(this.metres(70));
}
