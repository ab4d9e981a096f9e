/* The transport: a worker with a colony of the lab, which answers as a server does, see worker.js. */

let visit = ""; // the link of the last state

function openTransport() {
  const worker = new Worker(URL.createObjectURL(new Blob([WORKER], { type: "text/javascript" })));
  const transport = { readyState: WebSocket.OPEN, permit: true, send: (data) => worker.postMessage(data), close: () => worker.terminate() };
  worker.addEventListener("message", (event) => {
    if (typeof event.data === "string") visit = JSON.parse(event.data).link ?? visit;
    transport.onmessage(event);
  });
  worker.addEventListener("error", ({ message }) => transport.onclose({ code: 0, reason: message }));
  worker.postMessage({ wasm: Uint8Array.from(atob(COLONY), (letter) => letter.charCodeAt(0)), link: location.hash.slice(1) });
  return transport;
}

/* The page's own buttons: a visit is shared by its link, and goes on in the lab. */
byId("files").insertAdjacentHTML("afterbegin", '<button type="button" class="text-button" id="copy-link" title="Copy a link that replays this visit up to now">Copy link</button>'
  + '<button type="button" class="text-button" id="to-lab" title="Continue this visit in the lab">Open in lab</button>');
byId("to-lab").addEventListener("click", () => location.assign(`lab.html#${visit}`));
byId("copy-link").addEventListener("click", async () => {
  window.history.replaceState(null, "", `#${visit}`);
  try {
    await navigator.clipboard.writeText(location.href);
    live.controls.say("Link copied. It replays this visit to the same state.");
  } catch {
    live.controls.say("The address holds the link now. Copy it from there.");
  }
});
addEventListener("hashchange", () => location.reload());
