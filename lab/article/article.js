/* article.js: ten worlds in a text, and Python that replays the one that ran last. */

import { pythonOf } from "../page/link.js";
import { openPage, Stage } from "./world.js";

class Article extends Stage {
  constructor() {
    super();
    new IntersectionObserver(([{ isIntersecting }]) => isIntersecting && this.python()).observe(document.getElementById("python"));
  }

  /** Three lines of Python that replay the world that ran last, up to the tick at which the reader gets here. */
  python() {
    if (this.last?.run) document.getElementById("python").textContent = pythonOf(this.last.run.engine);
  }
}

openPage("article", Article);
