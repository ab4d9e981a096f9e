/* looks.js: the colours of the world. Only three things are bright: ants, food with what ants carry, and scent. */

export const LOOKS = {
  dark: {
    floor: ["#1d2a33", "#121a20"], rim: "#2d3d48", grain: "rgba(190,215,225,.055)",
    rock: "#3a4954", rockTop: "#627885", rockLow: "#283540", rockShade: "rgba(0,0,0,.5)",
    scent: [[6, 38, 64], [7, 64, 90], [12, 88, 106], [26, 112, 116]], blend: "lighter", bloom: 0.35,
    ant: "#f6ecda", legs: "rgba(246,236,218,.62)", shadow: "rgba(0,0,0,.45)", edge: "rgba(8,13,17,.85)",
    load: "#ffb938", loadGlow: "rgba(255,185,56,.55)", foodGlow: "rgba(255,170,40,.13)",
    food: ["#ffb938", "#e08a12", "#ffd98a"], nest: "#ff9aa8", nestGlow: "rgba(255,125,145,.30)",
    label: "rgba(225,235,238,.85)", halo: "rgba(8,12,16,.9)", ghost: "#ffffff", scentBrush: "#2bb6b0",
    arrow: "rgba(235,245,245,.75)",
  },
  light: {
    floor: ["#fffbf2", "#f7efdf"], rim: "#dccfb6", grain: "rgba(110,85,45,.075)",
    rock: "#c6baa3", rockTop: "#ebe3d3", rockLow: "#ab9c80", rockShade: "rgba(92,70,36,.28)",
    scent: [[190, 232, 230], [140, 212, 213], [92, 188, 194], [58, 166, 178]], blend: "multiply", bloom: 0.3,
    ant: "#2c221a", legs: "rgba(44,34,26,.6)", shadow: "rgba(80,60,30,.25)", edge: "rgba(255,252,245,.9)",
    load: "#dd4a0c", loadGlow: "rgba(221,74,12,.28)", foodGlow: "rgba(238,122,0,.10)",
    food: ["#ee7a00", "#b95500", "#ffb35c"], nest: "#b3264a", nestGlow: "rgba(179,38,74,.18)",
    label: "rgba(58,46,32,.88)", halo: "rgba(255,252,245,.95)", ghost: "#1d1712", scentBrush: "#0f8a8a",
    arrow: "rgba(40,32,24,.7)",
  },
};

/** The same colour, transparent; a gradient to black would leave a grey ring. */
export const fade = (colour) => colour.replace(/[\d.]+\)$/, "0)");

/** The colours of 256 levels of scent, as pixels; spread by a power, so that weak scent is visible. */
export function scentRamp(stops) {
  const ramp = new Uint32Array(256);
  for (let k = 1; k < 256; k++) {
    const place = (k / 255) ** 0.8 * (stops.length - 1), low = Math.min(stops.length - 2, Math.floor(place));
    const [red, green, blue] = stops[low].map((v, c) => Math.round(v + (stops[low + 1][c] - v) * (place - low)));
    const alpha = Math.round(242 * Math.min(1, 0.1 + 0.9 * (k / 255) ** 0.55));
    ramp[k] = (alpha << 24 | blue << 16 | green << 8 | red) >>> 0;
  }
  return ramp;
}
