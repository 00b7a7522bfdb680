// The picture as PNG and SVG, and the motion as a video: made in this page, and given to the reader as a file.
function save(content, name) {
  const link = document.createElement("a");
  link.download = name;
  link.href = URL.createObjectURL(content);
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

const VIDEOS = ["video/webm;codecs=vp8", "video/webm;codecs=vp9", "video/webm", "video/mp4"];
const FRAMES = 30;
const HELD = 500;

function exportMenu(model, state, change, { paint, size }) {
  const say = (text) => (document.getElementById("said").textContent = text);
  const name = (end) => `${model.data.mission}-${state.time.toFixed(1)}s.${end}`;

  function png() {
    const [width, height] = size();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [2 * width, 2 * height];
    const context = canvas.getContext("2d");
    context.setTransform(2, 0, 0, 2, 0, 0);
    paint(context, width, height);
    canvas.toBlob((blob) => save(blob, name("png")), "image/png");
  }

  function svg() {
    const [width, height] = size();
    const context = svgCanvas(width, height, document.createElement("canvas").getContext("2d"));
    paint(context, width, height);
    save(new Blob([context.written(`${model.data.mission} at ${state.time.toFixed(2)} s`)], { type: "image/svg+xml" }), name("svg"));
  }

  // From the start to the end at the speed that is chosen, as it is seen now.
  async function video() {
    const type = VIDEOS.find((each) => window.MediaRecorder && MediaRecorder.isTypeSupported(each));
    if (!type) return say("this browser cannot record video");
    const canvas = document.createElement("canvas");
    const [width, height] = size().map((each) => each - (each % 2));
    [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d");
    const before = { time: state.time, playing: false };
    change({ time: 0, playing: false, recording: true });
    paint(context, width, height);
    const recorder = new MediaRecorder(canvas.captureStream(FRAMES), { mimeType: type, videoBitsPerSecond: 8e6 });
    const pieces = [];
    recorder.ondataavailable = (event) => pieces.push(event.data);
    const event = (name) => new Promise((done) => recorder.addEventListener(name, done, { once: true }));
    const [started, ended] = [event("start"), event("stop")];
    recorder.start();
    await started;
    // The first and the last picture stay for a moment: an encoder takes that long to begin, and a reader to look.
    for (let [begin, now] = [performance.now(), 0]; state.recording; ) {
      now = (await new Promise(requestAnimationFrame)) - begin - HELD;
      const time = Math.min(model.horizon, (Math.max(0, now) / 1000) * state.speed);
      change({ time, playing: false });
      paint(context, width, height);
      say(`recording: ${Math.round((100 * time) / model.horizon)} %`);
      if (now > HELD + (1000 * model.horizon) / state.speed) break;
    }
    recorder.stop();
    await ended;
    say("");
    change({ ...before, recording: false });
    save(new Blob(pieces, { type }), `${model.data.mission}.${type.includes("mp4") ? "mp4" : "webm"}`);
  }

  const menu = document.getElementById("export");
  for (const [id, make] of [["png", png], ["svg", svg], ["video", video]]) {
    document.getElementById(id).addEventListener("click", () => {
      menu.open = false;
      make();
    });
  }
}
