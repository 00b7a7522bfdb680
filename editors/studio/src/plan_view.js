// The plan: how far a compilation is, what came of it, and its report.
const byId = (id) => document.getElementById(id);

const OUTCOMES = {
  0: "verified plan",
  1: "errors in the mission, or output not writable",
  3: "no plan on the roadmaps",
  4: "no plan found within the limits",
  5: "plan failed verification",
  6: "infeasible for every motion",
  70: "internal error of the compiler",
};

export class PlanView {
  constructor() {
    this.began = 0;
    this.timer = 0;
    this.line = "";
  }

  get running() {
    return this.timer !== 0;
  }

  begin() {
    this.began = performance.now();
    this.line = "starting";
    clearInterval(this.timer);
    this.timer = setInterval(() => this.tick(), 200);
    this.state("running", "compiling");
    this.tick();
  }

  progress(line) {
    if (line) this.line = line;
  }

  tick() {
    byId("progress").textContent = `${((performance.now() - this.began) / 1000).toFixed(1)} s  ${this.line}`;
  }

  stopped() {
    this.rest();
    this.state("stopped", "stopped");
  }

  // `ended`: status, lines, says, report, as the server tells them.
  end({ status, lines, says, report, counts }) {
    this.rest();
    this.state(status === 0 ? "planned" : "refused", `${OUTCOMES[status] ?? "ended"}${status === 0 ? "" : ` (${counts})`}`);
    byId("summary").textContent = [...lines, says].filter(Boolean).join("\n");
    byId("details").hidden = !lines.length && !says;
    byId("details").open = !report;
    byId("keep").hidden = status !== 0;
    const frame = byId("report");
    frame.hidden = !report;
    if (report) frame.src = report;
    else frame.removeAttribute("src");
  }

  // The plan is of an older text.
  outdated() {
    if (byId("plan").dataset.state === "planned") byId("outcome").textContent = "verified plan of an earlier version of the text";
  }

  rest() {
    clearInterval(this.timer);
    this.timer = 0;
    byId("progress").textContent = "";
  }

  state(state, words) {
    byId("plan").dataset.state = state;
    byId("outcome").textContent = words;
    byId("compile").hidden = state === "running";
    byId("stop").hidden = state !== "running";
  }
}
