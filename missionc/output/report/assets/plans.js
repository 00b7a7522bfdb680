// Several plans of one mission: which of them the page shows, and a table to choose by.
function chosenPlan(whole) {
  const count = whole.plans ? whole.plans.length : 1;
  const rank = Number(new URLSearchParams(location.hash.slice(1)).get("plan"));
  const known = Number.isInteger(rank) && rank >= 2 && rank <= count;
  return known ? { data: whole.others[rank - 2], rank } : { data: whole, rank: 1 };
}

// The page begins anew with the plan that is chosen, at the time that is shown.
function plansTable(whole, rank, state) {
  const panel = document.getElementById("plans");
  if (!whole.plans) return;
  panel.hidden = false;
  const table = document.createElement("table");
  const top = table.createTHead().insertRow();
  for (const text of ["plan", "what differs", "length", "duration", "smallest margin"]) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = text;
    top.append(cell);
  }
  const body = table.createTBody();
  for (const plan of whole.plans) {
    const row = body.insertRow();
    row.setAttribute("aria-current", String(plan.rank === rank));
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = String(plan.rank);
    button.setAttribute("aria-label", `Show plan ${plan.rank}`);
    row.insertCell().append(button);
    row.insertCell().textContent = plan.rank === 1 ? "the best" : plan.differs.join("; ");
    row.insertCell().textContent = `${plan.length.toFixed(2)} m`;
    row.insertCell().textContent = `${Number(plan.duration.toFixed(2))} s`;
    row.insertCell().textContent = plan.margin === null ? "any" : `${short(plan.margin)} m`;
    row.addEventListener("click", () => {
      if (plan.rank === rank) return;
      const shown = new URLSearchParams(location.hash.slice(1));
      const now = { plan: plan.rank, t: state.time.toFixed(3), speed: state.speed, theme: state.theme };
      for (const [name, value] of Object.entries(now)) shown.set(name, value);
      if (state.playing) shown.set("play", "");
      else shown.delete("play");
      location.hash = String(shown);
      location.reload();
    });
  }
  panel.append(table);
}
