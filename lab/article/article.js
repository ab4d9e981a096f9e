/* article.js: ten worlds in a text, and Python that replays the one that ran last. */

import { linkOf } from "../page/link.js";
import { Stage } from "./world.js";

class Article extends Stage {
  constructor() {
    super();
    new IntersectionObserver(([{ isIntersecting }]) => isIntersecting && this.python()).observe(document.getElementById("python"));
  }

  /** Three lines of Python that replay the world that ran last, up to the tick at which the reader gets here. */
  python() {
    const world = this.last;
    if (!world || !world.run) return;
    const { engine } = world.run;
    document.getElementById("python").textContent = `from taichi_ants import replay\nvisit = replay("${linkOf(engine)}")\nprint(visit.hash)  # ${engine.hash()}`;
  }
}

try {
  Object.assign(window, { article: new Article() });
} catch (error) {
  document.querySelector(".lead").insertAdjacentHTML("afterend", "<p>This browser cannot run the worlds below: they need WebAssembly with SIMD. The text can be read.</p>");
  throw error;
}
