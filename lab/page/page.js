/* page.js: what all pages share: elements, icons, WebAssembly, and how they open. */

/** @returns {any} an element, or null */
export const byId = (id) => document.getElementById(id);

const ICONS = {
  play: '<path d="M5 3.2v11.6L15 9z"/>',
  pause: '<path d="M4.5 3h3.2v12H4.5zM10.3 3h3.2v12h-3.2z"/>',
  rock: '<path d="M3 13.5 4.6 7l4-3.6 4.6 2 2.3 5-1.6 3.1z"/>',
  food: '<circle cx="6" cy="11.3" r="3.2"/><circle cx="12.3" cy="11.3" r="3.2"/><circle cx="9.1" cy="5.8" r="3.2"/>',
  scent: '<path class="line" d="M2 12.5c2.2-3 4.4-3 6.6-.7s4.6 1.6 7.4-2.3M2 7.5c2.2-3 4.4-3 6.6-.7s4.6 1.6 7.4-2.3"/>',
  erase: '<path class="line" d="M7.2 14.8 2.6 10.2a1.3 1.3 0 0 1 0-1.8l5.6-5.600a1.3 1.3 0 0 1 1.8 0l4.7 4.700a1.3 1.3 0 0 1 0 1.800l-5.5 5.500zm1.5 0h6.5"/>',
  look: '<path class="line" d="M1.5 9S4.2 4 9 4s7.5 5 7.5 5-2.7 5-7.5 5S1.5 9 1.5 9z"/><circle cx="9" cy="9" r="2.4"/>',
  again: '<path d="M9 3.75v-3L5.25 4.5 9 8.25v-3A3.75 3.75 0 1 1 5.25 9h-1.5A5.25 5.25 0 1 0 9 3.75z"/>',
  undo: '<path class="line" d="M6.5 3.5 3 7l3.5 3.500M3.5 7h7a4 4 0 0 1 0 8H7"/>',
};
export const icon = (name) => `<svg viewBox="0 0 18 18" width="18" height="18" fill="currentColor" aria-hidden="true">${ICONS[name]}</svg>`;

/** The bytes of a .wasm file. */
// @ts-ignore: build.py declares BINARIES before all modules
export const bytesOf = (name) => Uint8Array.from(atob(BINARIES[name]), (c) => c.charCodeAt(0));

/** Open a page under a name, or say why it cannot run. */
export function openPage(name, Page) {
  try {
    window[name] = new Page();
  } catch (error) {
    const say = "This browser cannot run the ants: they need WebAssembly with SIMD. Please update it, or try another one.";
    document.querySelector("#sub, .lead").insertAdjacentHTML("afterend", `<p>${say}</p>`);
    throw error;
  }
}
