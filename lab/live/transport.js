/* The transport: a worker with a colony of the lab, which answers as a server does, see worker.js. */

function openTransport() {
  const worker = new Worker(URL.createObjectURL(new Blob([WORKER], { type: "text/javascript" })));
  const transport = { readyState: WebSocket.OPEN, permit: true, send: (data) => worker.postMessage(data), close: () => worker.terminate() };
  worker.addEventListener("message", (event) => transport.onmessage(event));
  worker.addEventListener("error", ({ message }) => transport.onclose({ code: 0, reason: message }));
  worker.postMessage({ wasm: Uint8Array.from(atob(COLONY), (letter) => letter.charCodeAt(0)), link: location.hash.slice(1) });
  return transport;
}
addEventListener("hashchange", () => location.reload());
