// A page opened from disk may not start a Worker from the file beside it: the search's script runs in a hidden frame instead.
// Messages are copies and arrive later, as a Worker's do; the search counts on both.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    onmessage = null;
    onerror = null;

    constructor(url) {
      super();
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.frame.srcdoc = "<!doctype html><title>search</title>";
      this.ready = new Promise((ready) => (this.frame.onload = () => this.begin(url, ready)));
      document.body.append(this.frame);
    }

    begin(url, ready) {
      const inside = this.frame.contentWindow;
      inside.postMessage = (data) => setTimeout(() => this.onmessage?.(new MessageEvent("message", { data })));
      const script = inside.document.createElement("script");
      script.src = url;
      script.onload = () => ready(inside);
      script.onerror = () => this.onerror?.(new Event("error", { cancelable: true }));
      inside.document.head.append(script);
    }

    postMessage(data) {
      const copy = structuredClone(data);
      this.ready.then((inside) =>
        setTimeout(() => inside.dispatchEvent(new MessageEvent("message", { data: copy })))
      );
    }

    terminate() {
      this.frame.remove();
    }
  };
}
