/* article.js: ten worlds in a text, and Python that replays the one that ran last. */

import { pythonOf } from "../page/link.js";
import { byId, openPage } from "../page/page.js";
import { Stage } from "./world.js";

class Article extends Stage {
  constructor() {
    super();
    new IntersectionObserver(([{ isIntersecting }]) => isIntersecting && this.python()).observe(byId("python"));
  }

  /** Three lines of Python that replay the world that ran last, up to the tick at which the reader gets here. */
  python() {
    if (this.last?.run) byId("python").textContent = pythonOf(this.last.run.engine);
  }
}

openPage("article", Article);
