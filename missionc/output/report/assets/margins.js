// The tightest margin of every kind of check, and what is known besides.
function margins(model, change) {
  const { checks, between, delays, figures, warnings, passed } = model.data;
  const panel = document.getElementById("margins");
  const proved = checks.filter((check) => !check.name.startsWith("simulated "));
  const count = proved.reduce((sum, check) => sum + check.count, 0);
  const failed = proved.filter((check) => !check.passed).length;
  document.getElementById("checked").textContent = passed ? `${count} checks passed; smallest margin of each kind` : `failed kinds of checks: ${failed}`;
  const table = titled(["check", "subject", "margin", "time"]);
  const body = table.tBodies[0];
  const exact = checks.filter((check) => check.passed && check.margin !== null && Math.abs(check.margin) < 5e-4);
  for (const check of checks.filter((each) => !exact.includes(each))) {
    const row = body.insertRow();
    row.title = check.detail;
    row.className = [!check.passed && "failed", check.tightest && "tightest"].filter(Boolean).join(" ");
    row.insertCell().textContent = `${check.passed ? "" : "✗ "}${checkName(check.name)}${check.tightest ? " ◆" : ""}`;
    const of = check.agents.length && !check.name.endsWith("requirement") ? check.agents.join(", ") : check.subject;
    row.insertCell().textContent = check.name.includes("obstacle") ? `${check.subject}, ${of}` : of;
    row.insertCell().textContent = marginText(check);
    row.insertCell().append(...(check.at === null ? [] : [moment(check.at, change)]));
  }
  for (const each of between) {
    const row = body.insertRow();
    row.title = each.detail;
    row.className = each.verdict === "fails between" ? "failed" : "figure";
    row.insertCell().textContent = "continuous time";
    row.insertCell().textContent = each.requirement;
    row.insertCell().textContent = BETWEEN[each.verdict];
    row.insertCell().append(...(each.at === null ? [] : [moment(each.at, change)]));
  }
  for (const each of delays) {
    const row = body.insertRow();
    row.title = each.breaks ? `One more step of delay, with all other agents on time, violates ${each.breaks.replaceAll("`", "")}.` : "With all other agents on time, no delay violates a check.";
    row.className = "figure";
    row.insertCell().textContent = "delay tolerance";
    row.insertCell().textContent = each.agent;
    row.insertCell().textContent = `${each.open ? "≥ " : ""}${Number(each.tolerated.toFixed(6))} s`;
    row.insertCell().append(...(each.at === null ? [] : [moment(each.at, change)]));
  }
  for (const figure of figures) {
    const row = body.insertRow();
    row.className = "figure";
    row.insertCell().textContent = figure.name;
    row.insertCell().textContent = figure.subject;
    row.insertCell().textContent = figure.value === null ? "unbounded" : amount(figure);
    row.insertCell();
  }
  panel.append(table);
  if (exact.length) {
    const note = document.createElement("p");
    note.textContent = `${exact.length === 1 ? "1 kind of check" : `${exact.length} kinds of checks`} passed with margin 0 (rounded to 0.001): ${exact.map((check) => checkName(check.name)).join(", ")}.`;
    panel.append(note);
  }
  const broken = between.filter((each) => each.verdict === "fails between").map((each) => each.detail);
  for (const warning of [...broken, ...warnings]) {
    const note = document.createElement("p");
    note.className = "warning";
    note.textContent = `⚠ ${warning}`;
    panel.append(note);
  }
}

const BETWEEN = { "holds throughout": "satisfied", "fails between": "violated between samples", "not decided": "not decided" };

// The certificate calls checks of the polynomials `flown …`, also after a stage (`home flown downwash`).
const checkName = (name) => name.replace(/(^| )flown /, "$1flight ");

// A check that passes with a negative margin is within its tolerance, which stands in place of the margin.
function marginText({ margin, passed, tolerance, unit }) {
  if (margin === null) return "unbounded";
  return passed && margin < 0 ? `within ±${Number(tolerance.toPrecision(2))} ${unit}`.trim() : `${short(margin)} ${unit.replace("^2", "²")}`;
}

// A table with a head, and no row yet.
function titled(columns) {
  const table = document.createElement("table");
  const top = table.createTHead().insertRow();
  for (const textContent of columns) top.append(Object.assign(document.createElement("th"), { scope: "col", textContent }));
  table.createTBody();
  return table;
}

function moment(time, change) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = `${Number(time.toFixed(2))} s`;
  button.setAttribute("aria-label", `Go to ${button.textContent}`);
  button.addEventListener("click", () => change({ time, playing: false }));
  return button;
}

/** A figure with its unit; the second eigenvalue of a graph has none, and goes by its sign. */
const amount = ({ value, unit }) => (unit === "lambda_2" ? `λ₂ = ${short(value)}` : `${short(value)} ${unit.replace("^2", "²")}`);
