/* film.js: six seconds as a video, cropped to the world. */

import { byId } from "./page.js";

const SECONDS = 6, BITS = 3.4e6, MOST_PIXELS_WIDE = 900, FRAMES = 30; // 3.4 Mbit/s: about 2.6 MB
const CANNOT = "This browser cannot record a canvas.";
const TYPES = ["video/mp4;codecs=avc1.42E01F", "video/mp4", "video/webm;codecs=vp9", "video/webm"];

export class Film {
  constructor(lab) {
    this.lab = lab;
    this.copy = null; // the canvas that is recorded now
    byId("film").addEventListener("click", () => { if (!this.copy) this.start(); });
  }

  start() {
    const { lab } = this, type = window.MediaRecorder && TYPES.find((one) => MediaRecorder.isTypeSupported(one));
    if (!type) return lab.toast(CANNOT);
    const canvases = lab.sides.filter((side) => side.run).map((side) => side.canvas);
    const copy = this.copy = document.createElement("canvas"), [{ width, height }] = canvases;
    const side = Math.min(width, height), scale = Math.min(1, MOST_PIXELS_WIDE / (side * canvases.length));
    copy.width = Math.round(side * canvases.length * scale / 2) * 2;
    copy.height = Math.round(Math.min(height, side * 1.16) * scale / 2) * 2;
    const recorder = new MediaRecorder(copy.captureStream(FRAMES), { mimeType: type, videoBitsPerSecond: BITS }), parts = [];
    recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    recorder.addEventListener("stop", () => this.save(new Blob(parts, { type: type.split(";")[0] })));
    this.add = () => { // the frame that was just drawn
      const x = copy.getContext("2d", { alpha: false });
      x.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--bg");
      x.fillRect(0, 0, copy.width, copy.height);
      canvases.forEach((canvas, k) => x.drawImage(canvas, (width - side) / 2, (height - copy.height / scale) / 2, side, copy.height / scale,
                                                  k * side * scale, 0, side * scale, copy.height));
    };
    lab.play(true);
    recorder.start();
    lab.toast("Recording six seconds …", SECONDS * 1000);
    setTimeout(() => recorder.stop(), SECONDS * 1000);
  }

  save(blob) {
    this.copy = null;
    this.bytes = blob.size;
    if (!blob.size) return this.lab.toast(CANNOT); // it lacks the encoder
    const link = document.createElement("a"), { tick, scene } = this.lab.runs[0];
    link.href = URL.createObjectURL(blob);
    link.download = `ants-${scene.seed}-${tick}.${blob.type.includes("mp4") ? "mp4" : "webm"}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    return this.lab.toast(`Saved a video of ${(blob.size / 1e6).toFixed(1)} MB.`);
  }
}
