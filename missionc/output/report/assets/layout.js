// The parts of the page: how they share it, and the map alone.
function splitters(change) {
  const main = document.querySelector("main");
  for (const [id, name, sideways, part] of [["split-side", "--side", true, "side"], ["split-time", "--lanes", false, "time"]]) {
    const bar = document.getElementById(id);
    const room = () => (sideways ? main.clientWidth : main.clientHeight);
    const set = (pixels) => {
      const share = Math.min(0.8, Math.max(0.12, pixels / room()));
      main.style.setProperty(name, `${(100 * share).toFixed(2)}%`);
      bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
      change({ layout: true });
    };
    const now = () => document.getElementById(part)[sideways ? "offsetWidth" : "offsetHeight"];
    const at = (event) => {
      const box = main.getBoundingClientRect();
      return sideways ? box.right - event.clientX : box.bottom - event.clientY;
    };
    bar.addEventListener("pointerdown", (event) => bar.setPointerCapture(event.pointerId));
    bar.addEventListener("pointermove", (event) => bar.hasPointerCapture(event.pointerId) && set(at(event)));
    bar.addEventListener("dblclick", () => {
      main.style.removeProperty(name);
      change({ layout: true });
    });
    bar.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: 20, ArrowUp: 20, ArrowRight: -20, ArrowDown: -20 }[event.key];
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      set(now() + by);
    });
  }
}

// The map and the player alone, on the whole screen where the browser lets it.
function fullScreen(state, change) {
  const button = document.getElementById("wide");
  const root = document.documentElement;
  const set = (wide) => {
    root.classList.toggle("wide", wide);
    button.setAttribute("aria-pressed", String(wide));
    change({ wide, layout: true });
  };
  button.addEventListener("click", async () => {
    const wide = !state.wide;
    set(wide);
    try {
      if (wide) await root.requestFullscreen();
      else if (document.fullscreenElement) await document.exitFullscreen();
    } catch {
      // In a frame that may not: the page alone is filled.
    }
  });
  document.addEventListener("fullscreenchange", () => !document.fullscreenElement && state.wide && set(false));
  return () => state.wide && button.click();
}
