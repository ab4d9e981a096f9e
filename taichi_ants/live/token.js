/* The secret of the address, which authorises this page. The script removes it from the address and
   the history at once, and stores it for this tab, for reloads. A cookie would be sent to all ports of
   this machine, where other users may have servers. */

const TOKEN = (() => {
  const name = "taichi-ants token", given = new URLSearchParams(location.search).get("token");
  if (given !== null) {
    sessionStorage.setItem(name, given);
    window.history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(name) ?? "";
})();
