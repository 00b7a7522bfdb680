// The tightest margin of every kind of check, and what is known besides.
function margins(model, change) {
  const { checks, between, delays, figures, warnings, passed } = model.data;
  const panel = document.getElementById("margins");
  const proved = checks.filter((check) => !check.name.startsWith("simulated "));
  const count = proved.reduce((sum, check) => sum + check.count, 0);
  const failed = proved.filter((check) => !check.passed).length;
  document.getElementById("checked").textContent = passed ? `all ${count} checks pass; the tightest of each kind` : `${failed} ${failed === 1 ? "kind of check fails" : "kinds of checks fail"}`;
  const table = titled(["check", "of", "margin", "at"]);
  const body = table.tBodies[0];
  const exact = checks.filter((check) => check.passed && check.margin !== null && Math.abs(check.margin) < 5e-4);
  for (const check of checks.filter((each) => !exact.includes(each))) {
    const row = body.insertRow();
    row.title = check.detail;
    row.className = [!check.passed && "failed", check.tightest && "tightest"].filter(Boolean).join(" ");
    row.insertCell().textContent = `${check.passed ? "" : "✗ "}${check.name}${check.tightest ? " ◆" : ""}`;
    const of = check.agents.length && !check.name.endsWith("requirement") ? check.agents.join(", ") : check.subject;
    row.insertCell().textContent = check.name.includes("obstacle") ? `${check.subject}, ${of}` : of;
    row.insertCell().textContent = check.margin === null ? "any" : `${short(check.margin)} ${check.unit}`;
    row.insertCell().append(...(check.at === null ? [] : [moment(check.at, change)]));
  }
  for (const each of between) {
    const row = body.insertRow();
    row.title = each.detail;
    row.className = each.verdict === "fails between" ? "failed" : "figure";
    row.insertCell().textContent = "between steps";
    row.insertCell().textContent = each.requirement;
    row.insertCell().textContent = each.verdict;
    row.insertCell().append(...(each.at === null ? [] : [moment(each.at, change)]));
  }
  for (const each of delays) {
    const row = body.insertRow();
    row.title = each.breaks ? `one step later, everybody else on time: ${each.breaks.replaceAll("`", "")} breaks` : "everybody else on time, nothing breaks";
    row.className = "figure";
    row.insertCell().textContent = "may be late by";
    row.insertCell().textContent = each.agent;
    row.insertCell().textContent = `${each.open ? "≥ " : ""}${Number(each.tolerated.toFixed(6))} s`;
    row.insertCell().append(...(each.at === null ? [] : [moment(each.at, change)]));
  }
  for (const figure of figures) {
    const row = body.insertRow();
    row.className = "figure";
    row.insertCell().textContent = figure.name;
    row.insertCell().textContent = figure.subject;
    row.insertCell().textContent = figure.value === null ? "any" : amount(figure);
    row.insertCell();
  }
  panel.append(table);
  if (exact.length) {
    const note = document.createElement("p");
    note.textContent = `${exact.length === 1 ? "1 exact check passes" : `${exact.length} exact checks pass`}: ${exact.map((check) => check.name).join(", ")}.`;
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
const amount = ({ value, unit }) => (unit === "lambda_2" ? `λ₂ = ${short(value)}` : `${short(value)} ${unit}`);
