/* The transport of the live page: a socket. It needs the secret of the address, which the script removes
   from the address and the history at once, and stores for this tab, for reloads. A cookie would be
   sent to all ports of this machine, where other users may have servers. */

const TOKEN = (() => {
  const name = "taichi-ants token", given = new URLSearchParams(location.search).get("token");
  if (given !== null) {
    sessionStorage.setItem(name, given);
    window.history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(name) ?? "";
})();

/* A transport has readyState, send(data), close(), onmessage({data}) and onclose({code, reason}); without
   a `permit`, it is no use to open it again. */
function openTransport() {
  const socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(TOKEN)}`);
  return Object.assign(socket, { binaryType: "arraybuffer", permit: TOKEN !== "" });
}
