// Several plans of one mission: which of them the page shows, and a table to choose by.
function chosenPlan(whole) {
  const count = 1 + (whole.others || []).length;
  const rank = Number(new URLSearchParams(location.hash.slice(1)).get("plan"));
  const known = Number.isInteger(rank) && rank >= 2 && rank <= count;
  return known ? { data: whole.others[rank - 2], rank } : { data: whole, rank: 1 };
}

// The page begins anew with the plan that is chosen, at the time that is shown.
function showPlan(chosen, address) {
  const shown = new URLSearchParams(address.split("#")[1]);
  shown.set("plan", chosen);
  for (const name of ["lane", "agent", "chase"]) shown.delete(name);
  location.hash = String(shown);
  location.reload();
}

function plansTable(whole, rank, address) {
  const panel = document.getElementById("plans");
  if (!whole.plans) return;
  panel.hidden = false;
  const table = titled(["plan", "difference", "path length (m)", "duration (s)", "smallest margin (m)"]);
  const body = table.tBodies[0];
  for (const plan of whole.plans) {
    const row = body.insertRow();
    row.setAttribute("aria-current", String(plan.rank === rank));
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = String(plan.rank);
    button.setAttribute("aria-label", `Show plan ${plan.rank}`);
    row.insertCell().append(button);
    row.insertCell().textContent = plan.rank === 1 ? "best plan" : plan.differs.join("; ");
    row.insertCell().textContent = plan.length.toFixed(2);
    row.insertCell().textContent = String(Number(plan.duration.toFixed(2)));
    row.insertCell().textContent = plan.margin === null ? "unbounded" : short(plan.margin);
    row.addEventListener("click", () => {
      if (plan.rank === rank) return;
      showPlan(plan.rank, address());
    });
  }
  panel.append(table);
}
