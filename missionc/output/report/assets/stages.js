// The attempts that led to the plan, in order, folded away below the margins.
function stagesTable(stages) {
  if (!stages.length) return;
  const folded = document.createElement("details");
  folded.id = "stages";
  folded.append(Object.assign(document.createElement("summary"), { textContent: `planning attempts (${stages.length})` }));
  const table = titled(["stage", "backend", "outcome", "work (units)", "next stage"]);
  const body = table.tBodies[0];
  for (const { stage, attempt, engine, outcome, work, then } of stages) {
    const row = body.insertRow();
    for (const text of [attempt ? `${stage}: ${attempt}` : stage, engine, outcome, work ? String(work) : "", then]) row.insertCell().textContent = text;
  }
  folded.append(table);
  document.getElementById("margins").append(folded);
}
