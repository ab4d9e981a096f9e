/* The secret of the address, which lets this page in. It is taken out of the address and the history
   at once. A reload finds it in the storage of this tab: a cookie would go to all ports of this
   machine, where other users may have servers. */

const TOKEN = (() => {
  const name = "taichi-ants token", given = new URLSearchParams(location.search).get("token");
  if (given !== null) {
    sessionStorage.setItem(name, given);
    window.history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(name) ?? "";
})();
