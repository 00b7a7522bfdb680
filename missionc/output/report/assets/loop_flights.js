// Flights in a closed loop: how often what was kept, a row for each flight, and what happened in the chosen one. The
// first one is drawn, and its times go there.
function loopFlights(model, change) {
  const { loop } = model.data;
  if (!loop) return;
  const panel = document.getElementById("advice");
  panel.hidden = false;
  panel.setAttribute("aria-label", "Simulated flights");
  const put = (to, tag, text, className = "") => {
    const made = Object.assign(document.createElement(tag), { textContent: text.replaceAll("`", ""), className });
    to.append(made);
    return made;
  };
  put(panel, "h2", `Simulation: ${loop.flown === 1 ? "1 flight" : `${loop.flown} flights`}`);
  put(panel, "p", `Disturbances: ${loop.through}. Replanning: ${loop.replans ? "on" : "off"}.`);
  if (loop.flown > 1) panel.append(shares(loop.kept));
  const heading = put(panel, "h3", "");
  const list = put(panel, "ul", "", "told");
  const drawn = put(panel, "p", "Map: first flight (solid), uploaded plans (dash-dotted), first plan (dotted). The rows below show the first plan.", "note");
  panel.append(drawn);

  function choose(flight) {
    heading.textContent = loop.flown === 1 ? "Events" : `Events of flight ${flight.number}`;
    list.replaceChildren(
      ...flight.told.map(({ t, by, says }) => {
        const item = Object.assign(document.createElement("li"), { className: by });
        item.append(flight.number === 1 ? moment(t, change) : `${Number(t.toFixed(2))} s`, ` ${says.replaceAll("`", "")}`);
        return item;
      }),
    );
    if (!flight.told.length) put(list, "li", "none");
    for (const row of document.querySelectorAll("#plans tbody tr")) row.setAttribute("aria-current", String(Number(row.dataset.flight) === flight.number));
  }

  if (loop.flown > 1) flightRows(loop, choose);
  choose(loop.flights[0]);
}

// How many flights kept each requirement, and of which share that is true at least and at most.
const KEPT = { "all of them": "all requirements", "nothing touched": "no collision" };

function shares(kept) {
  const table = titled(["requirement", "satisfied in", "share (two-sided 95 % confidence interval)"]);
  for (const { name, held, of, low, high } of kept) {
    const row = table.tBodies[0].insertRow();
    row.className = held < of ? "failed" : "";
    row.insertCell().textContent = `${held < of ? "✗ " : ""}${KEPT[name] ?? name}`;
    row.insertCell().textContent = `${held} of ${of} flights`;
    row.insertCell().textContent = `${(Math.floor(1000 * low) / 10).toFixed(1)} to ${(Math.ceil(1000 * high) / 10).toFixed(1)} %`;
  }
  return table;
}

function flightRows({ flights, flown }, choose) {
  const panel = document.getElementById("plans");
  panel.hidden = false;
  panel.setAttribute("aria-label", "Flights");
  const table = titled(["flight", flown > flights.length ? `result (${flights.length} of ${flown} flights)` : "result", "new plans", "smallest distance (m)", "closest pair, time"]);
  for (const flight of flights) {
    const row = table.tBodies[0].insertRow();
    row.dataset.flight = flight.number;
    row.className = flight.passed ? "" : "failed";
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: String(flight.number) });
    button.setAttribute("aria-label", `Events of flight ${flight.number}`);
    row.insertCell().append(button);
    const wrong = [...flight.lost, ...(flight.touched ? ["collision"] : [])];
    row.insertCell().textContent = wrong.length ? `✗ violated: ${wrong.join(", ")}` : "satisfied";
    row.insertCell().textContent = String(flight.plans);
    row.insertCell().textContent = flight.room === null ? "unbounded" : short(flight.room);
    row.insertCell().textContent = flight.nearest ? `${flight.nearest.of.join(", ")} at ${Number(flight.nearest.t.toFixed(1))} s` : "";
    row.addEventListener("click", () => choose(flight));
  }
  panel.append(table);
}
