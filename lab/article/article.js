/* article.js: ten worlds in a text, and Python that replays the one that ran last. */

import { linkOf } from "../page/link.js";
import { openPage, Stage } from "./world.js";

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

openPage("article", Article);
